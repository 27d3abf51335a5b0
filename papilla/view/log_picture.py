"""A log and its estimates in one picture: measured values at the top, then the answers with their bands, the codes of
each quantity, and the spectrum over the path."""

import math
from collections.abc import Collection, Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from papilla.core.checks import ROUNDING
from papilla.core.units import PER_CENT
from papilla.logs.statistics import Thinned
from papilla.view.style import ACCENTS, INK, MUTED, THIN, named, plain_log, styled, titled

MEASURED = {
    "force_N": "force (N)",
    "tangential_N": "tangential\nforce (N)",
    "velocity_mm_s": "velocity\n(mm/s)",
    "position_mm": "position\n(mm)",
}
ANSWERS = {
    "modulus": ("modulus_MPa", "modulus_sigma_MPa", "modulus\n(MPa)"),
    "wavelength": ("wavelength_mm", "wavelength_sigma_mm", "wavelength\n(mm)"),
    "friction": ("mu_kinetic", "mu_kinetic_sigma", "kinetic\nfriction"),
}
BAND = 2.0
"""Half width of the bands, in standard deviations."""
ROUNDED = 1e-6
"""Change of a quantity, relative to its size, that is rounding."""
APART = 0.08
"""Distance of two names of lines, as a share of the spectrum's axis: the width of a name."""
WIDE_IN, PANEL_IN, TALL, STRIP, BAR = 10.0, 1.3, 2.0, 0.3, 0.8
"""Inches of the picture's width and of a panel's height; heights of the panels of readings and of the spectrum, and
of a strip of codes, in panels; height of a bar in its strip."""
BESIDE: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1, 1), "frameon": False}
"""Place of the names of curves and codes: to the right of their panel."""
HELD, RARE, ROOM = 0.1, 3, 0.3
"""Limits around a constant, as a share of it; per cent of the bands that limits may cut at each end, and the room that
they leave, as a share of the range."""
POINTS, MOST_NAMES, LIFTED = 4000, 6, 4
"""Points of a spectrum; lines with a name, and the distance of the name in points."""
BEYOND, LEAST_POWER = (10, 8), 1e-6
"""Factors by which a spectrum's axis goes below the median and above the peak; its smallest power."""
OK, REMARK = ACCENTS[0], "#8fb8de"
DOUBTS = ("#e3e7ec", "#f0b27a", "#cdb4db", "#a3b1c2", "#f5c6cb", "#c2410c", "#b7791f", "#7c3aed", "#be185d", "#475569")
"""Colours of the codes that are not ok, in the order in which they occur; the first one is that at the beginning of
most logs."""
COLUMNS, VALUE, CODE = 5, 3, 4
"""Columns of a quantity: usable value, ends of its band, any value, code. Where the last two stand."""
_RANK = 1000  # Number of a code in a bin: its rank (0 for ok to 2 for not ok) times this, plus its own number


class LogPicture:
    """Gathers a log and its estimates block by block, thinned, and draws them.

    gauges, optional : names of the columns of a block after t_s. off : quantities without an estimate.
    """

    def __init__(self, gauges: Sequence[str], optional: Sequence[str], off: Collection[str]):
        self._gauges, self._optional = tuple(gauges), tuple(optional)
        self._quantities = [name for name in ANSWERS if name not in off]
        self._alone = "wavelength" in off and "frequency" not in off and bool(gauges)
        self._codes: dict[str, int] = {}
        self._thinned = Thinned()

    def add(self, block: np.ndarray, answer: Any) -> None:
        """Add the next rows (n, columns) and their answers, a `papilla.estimators.PipelineEstimate`."""
        columns = [block]
        for quantity in self._quantities:
            value_name, sigma_name, _ = ANSWERS[quantity]
            codes = np.array([self._number(code) for code in getattr(answer, f"{quantity}_status")])
            value, sigma = (np.asarray(getattr(answer, name), float) for name in (value_name, sigma_name))
            usable = np.where(codes < 2 * _RANK, value, np.nan)
            columns += [usable, usable - BAND * sigma, usable + BAND * sigma, value, codes.astype(float)]
        if self._alone:
            columns.append(np.asarray(answer.frequency_Hz, float))
        self._thinned.add(np.column_stack(columns))

    def _number(self, code: str) -> int:
        if (known := self._codes.get(code)) is not None:
            return known
        rank = 0 if code == "ok" else 1 if code.startswith("ok") else 2
        return self._codes.setdefault(code, rank * _RANK + len(self._codes))

    def figure(self, title: str, detail: str, spectrum: Any) -> Figure:
        """The picture. spectrum : over the path with its lines, a `LineSpectrum` of `find_lines`, or None."""
        measured = [name for name in MEASURED if name in self._optional]
        heights = [TALL] * bool(self._gauges) + [1.0] * (len(measured) + len(self._quantities) + self._alone)
        heights += [STRIP * len(self._quantities)] * bool(self._quantities)
        timed, heights = len(heights), heights + [TALL] * (spectrum is not None)
        with styled(WIDE_IN, PANEL_IN * (sum(heights) + 1)) as figure:
            panels = figure.subplots(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
            for axes in panels[1:timed]:
                axes.sharex(panels[0])
            for axes in panels[: timed - 1]:
                axes.tick_params(labelbottom=False)
            panels[timed - 1].set_xlabel("time (s)")
            self._draw(panels[:timed], measured)
            if spectrum is not None:
                _draw_spectrum(panels[-1], spectrum)
            titled(figure, title, detail)
        return figure

    def _draw(self, panels: Iterable[Axes], measured: list[str]) -> None:
        low, high, axes = self._thinned.low, self._thinned.high, iter(panels)
        time, names = low[:, 0], ["t_s", *self._gauges, *self._optional]
        if self._gauges:
            own = next(axes)
            for number, name in enumerate(self._gauges):
                _trace(own, time, low[:, 1 + number], high[:, 1 + number], ACCENTS[number % len(ACCENTS)], name)
            own.set_ylabel("readings (µε)")
            own.legend(**BESIDE)
        for name in measured:
            own, column = next(axes), names.index(name)
            _trace(own, time, low[:, column], high[:, column], INK, "")
            _widen(own)
            own.set_ylabel(MEASURED[name])
        for number, quantity in enumerate(self._quantities):
            own, first = next(axes), len(names) + COLUMNS * number
            _trace(own, time, low[:, first + VALUE], high[:, first + VALUE], MUTED, "")
            own.fill_between(time, low[:, first + 1], high[:, first + 2], color=REMARK, alpha=0.5, linewidth=0)
            _trace(own, time, low[:, first], high[:, first], OK, "")
            _frame(own, low[:, first + 1], high[:, first + 2])
            own.set_ylabel(ANSWERS[quantity][2])
            if not number:
                told = "blue: may be used,\nwith its 95 % band;\ngrey: in doubt"
                key = own.legend([], [], title=told, title_fontsize="small", **BESIDE)
                key.get_title().set_color(MUTED)
        if self._alone:
            own = next(axes)
            _trace(own, time, low[:, -1], high[:, -1], OK, "")
            own.set_ylabel("frequency\n(Hz)")
        if self._quantities:
            self._draw_codes(next(axes), time, high)

    def _draw_codes(self, axes: Axes, time: np.ndarray, high: np.ndarray) -> None:
        """A strip for each quantity, in the colour of the worst code of each bin."""
        shades = {number: OK if number < _RANK else REMARK for number in self._codes.values()}
        doubts = [number for number in self._codes.values() if number >= 2 * _RANK]
        shades |= {number: DOUBTS[k % len(DOUBTS)] for k, number in enumerate(doubts)}
        edges = np.append(time, time[-1] + (time[-1] - time[0]) / max(len(time) - 1, 1))
        first, shown = 1 + len(self._gauges) + len(self._optional), set()
        for row, _quantity in enumerate(self._quantities):
            codes = high[:, first + COLUMNS * row + CODE].astype(int)
            starts = np.flatnonzero(np.diff(codes, prepend=-1))
            spans = [(edges[a], edges[b] - edges[a]) for a, b in zip(starts, [*starts[1:], len(codes)], strict=True)]
            axes.broken_barh(spans, (row - 0.5 * BAR, BAR), facecolors=[shades[codes[start]] for start in starts])
            shown |= {*codes.tolist()}
        axes.set(
            ylim=(len(self._quantities) - 0.5, -0.5), yticks=range(len(self._quantities)), xlim=(edges[0], edges[-1])
        )
        axes.set_yticklabels(self._quantities)
        axes.grid(visible=False)
        keys: list[Any] = [Patch(color=shades[n], label=code) for code, n in self._codes.items() if n in shown]
        axes.legend(handles=keys, **BESIDE)


def _trace(axes: Axes, time: np.ndarray, low: np.ndarray, high: np.ndarray, color: str, label: str) -> None:
    """A curve, drawn as the area between its lowest and highest value in each bin."""
    axes.fill_between(time, low, high, color=color, alpha=0.45, linewidth=0)
    axes.plot(time, 0.5 * (low + high), color=color, linewidth=THIN, label=named(label))


def _widen(axes: Axes) -> None:
    """Limits of a tenth around a quantity that was held constant, of which the axis would show the rounding."""
    low, high = axes.dataLim.intervaly
    size = max(abs(low), abs(high))
    if high - low < ROUNDED * size:
        axes.set_ylim(low - HELD * size, high + HELD * size)


def _frame(axes: Axes, low: np.ndarray, high: np.ndarray) -> None:
    """Limits that show nearly all bands: a few wide ones at the beginning would hide the others."""
    known = np.isfinite(low) & np.isfinite(high)
    if known.any():
        bottom, top = np.percentile(low[known], RARE), np.percentile(high[known], PER_CENT - RARE)
        room = ROOM * (top - bottom) + ROUNDING
        axes.set_ylim(bottom - room, top + room)


def _draw_spectrum(axes: Axes, spectrum: Any) -> None:
    known = spectrum.wavenumber_per_mm > 0
    wavelength, power = 1 / spectrum.wavenumber_per_mm[known], spectrum.power[known]
    starts = np.arange(0, len(power), max(1, len(power) // POINTS))
    axes.fill_between(
        wavelength[starts], 0.0, np.maximum.reduceat(power, starts), color=MUTED, linewidth=0, step="post"
    )
    below, above = BEYOND
    axes.set(
        xscale="log", yscale="log", xlabel="wavelength (mm)", ylabel="spectrum over\nthe path",
        xlim=(float(wavelength.min()), float(wavelength.max())),
        ylim=(max(float(np.median(power)) / below, LEAST_POWER), above * float(power.max())),
    )  # fmt: skip
    plain_log(axes.xaxis)
    named: list[float] = []
    for line in spectrum.lines[:MOST_NAMES]:
        place = math.log(line.wavelength_mm)
        if any(abs(place - other) < APART * math.log(wavelength.max() / wavelength.min()) for other in named):
            continue
        named.append(place)
        peak = float(power[np.argmin(np.abs(wavelength - line.wavelength_mm))])
        axes.annotate(
            f"{line.wavelength_mm:.4g} mm", (line.wavelength_mm, peak), xytext=(0, LIFTED), textcoords="offset points",
            ha="center", fontsize="small", color=OK if line.harmonic == 1 else MUTED,
        )  # fmt: skip
