"""A log and its estimates in one picture: measured values at the top, then the answers with their bands, the codes of
each quantity, and the spectrum over the path."""

import math
from collections.abc import Collection, Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from papilla.core.checks import ROUNDING_SHARE
from papilla.core.units import PER_CENT
from papilla.logs.statistics import Thinned
from papilla.view.style import ACCENT_COLORS, INK_COLOR, MUTED_COLOR, THIN_PT, named, plain_log, styled, titled

MEASURED_LABELS = {
    "force_N": "force (N)",
    "tangential_N": "tangential\nforce (N)",
    "velocity_mm_s": "velocity\n(mm/s)",
    "position_mm": "position\n(mm)",
}
ANSWER_COLUMNS = {
    "modulus": ("modulus_MPa", "modulus_sigma_MPa", "modulus\n(MPa)"),
    "wavelength": ("wavelength_mm", "wavelength_sigma_mm", "wavelength\n(mm)"),
    "friction": ("mu_kinetic", "mu_kinetic_sigma", "kinetic\nfriction"),
}
BAND_SIGMAS = 2.0
"""Half width of the bands, in standard deviations."""
ROUNDING_CHANGE = 1e-6
"""Change of a quantity, relative to its size, that is rounding."""
NAME_DISTANCE = 0.08
"""Distance of two names of lines, as a share of the spectrum's axis: the width of a name."""
WIDE_IN, LOG_PANEL_IN, TALL_PANELS, STRIP_PANELS, STRIP_BAR_HEIGHT = 10.0, 1.3, 2.0, 0.3, 0.8
"""Inches of the picture's width and of a panel's height; heights of the panels of readings and of the spectrum, and
of a strip of codes, in panels; height of a bar in its strip."""
LEGEND_PLACE: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1, 1), "frameon": False}
"""Place of the names of curves and codes: to the right of their panel."""
CONSTANT_LIMITS, CUT_PER_CENT, LIMIT_ROOM = 0.1, 3, 0.3
"""Limits around a constant, as a share of it; per cent of the bands that limits may cut at each end, and the room that
they leave, as a share of the range."""
SPECTRUM_POINTS, MOST_NAMES, NAME_LIFT_PT = 4000, 6, 4
"""Points of a spectrum; lines with a name, and the distance of the name in points."""
SPECTRUM_MARGINS, LEAST_POWER = (10, 8), 1e-6
"""Factors by which a spectrum's axis goes below the median and above the peak; its smallest power."""
OK_COLOR, REMARK_COLOR = ACCENT_COLORS[0], "#8fb8de"
DOUBT_COLORS = (
    "#e3e7ec",
    "#f0b27a",
    "#cdb4db",
    "#a3b1c2",
    "#f5c6cb",
    "#c2410c",
    "#b7791f",
    "#7c3aed",
    "#be185d",
    "#475569",
)
"""Colours of the codes that are not ok, in the order in which they occur; the first one is that at the beginning of
most logs."""
LOG_QUANTITY_COLUMNS, VALUE_COLUMN, CODE_COLUMN = 5, 3, 4
"""Columns of a quantity: usable value, ends of its band, any value, code. Where the last two stand."""
_RANK = 1000  # Number of a code in a bin: its rank (0 for ok to 2 for not ok) times this, plus its own number


class LogPicture:
    """Gathers a log and its estimates block by block, thinned, and draws them.

    gauges, optional : names of the columns of a block after t_s. off : quantities without an estimate.
    """

    def __init__(self, gauges: Sequence[str], optional: Sequence[str], off: Collection[str]):
        self._gauges, self._optional = tuple(gauges), tuple(optional)
        self._quantities = [name for name in ANSWER_COLUMNS if name not in off]
        self._alone = "wavelength" in off and "frequency" not in off and bool(gauges)
        self._codes: dict[str, int] = {}
        self._thinned = Thinned()

    def add(self, block: np.ndarray, answer: Any) -> None:
        """Add the next rows (n, columns) and their answers, a `papilla.estimators.PipelineEstimate`."""
        columns = [block]
        for quantity in self._quantities:
            value_name, sigma_name, _ = ANSWER_COLUMNS[quantity]
            codes = np.array([self._number(code) for code in getattr(answer, f"{quantity}_status")])
            value, sigma = (np.asarray(getattr(answer, name), float) for name in (value_name, sigma_name))
            usable = np.where(codes < 2 * _RANK, value, np.nan)
            columns += [usable, usable - BAND_SIGMAS * sigma, usable + BAND_SIGMAS * sigma, value, codes.astype(float)]
        if self._alone:
            columns.append(np.asarray(answer.frequency_Hz, float))
        self._thinned.add(np.column_stack(columns))

    def _number(self, code: str) -> int:
        if (number := self._codes.get(code)) is not None:
            return number
        rank = 0 if code == "ok" else 1 if code.startswith("ok") else 2
        return self._codes.setdefault(code, rank * _RANK + len(self._codes))

    def figure(self, title: str, detail: str, spectrum: Any) -> Figure:
        """The picture. spectrum : over the path with its lines, a `LineSpectrum` of `find_lines`, or None."""
        measured = [name for name in MEASURED_LABELS if name in self._optional]
        heights = [TALL_PANELS] * bool(self._gauges) + [1.0] * (len(measured) + len(self._quantities) + self._alone)
        heights += [STRIP_PANELS * len(self._quantities)] * bool(self._quantities)
        timed, heights = len(heights), heights + [TALL_PANELS] * (spectrum is not None)
        with styled(WIDE_IN, LOG_PANEL_IN * (sum(heights) + 1)) as figure:
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
            panel = next(axes)
            for number, name in enumerate(self._gauges):
                color = ACCENT_COLORS[number % len(ACCENT_COLORS)]
                _trace(panel, time, low[:, 1 + number], high[:, 1 + number], color, name)
            panel.set_ylabel("readings (µε)")
            panel.legend(**LEGEND_PLACE)
        for name in measured:
            panel, column = next(axes), names.index(name)
            _trace(panel, time, low[:, column], high[:, column], INK_COLOR, "")
            _widen(panel)
            panel.set_ylabel(MEASURED_LABELS[name])
        for number, quantity in enumerate(self._quantities):
            panel, first = next(axes), len(names) + LOG_QUANTITY_COLUMNS * number
            _trace(panel, time, low[:, first + VALUE_COLUMN], high[:, first + VALUE_COLUMN], MUTED_COLOR, "")
            panel.fill_between(time, low[:, first + 1], high[:, first + 2], color=REMARK_COLOR, alpha=0.5, linewidth=0)
            _trace(panel, time, low[:, first], high[:, first], OK_COLOR, "")
            _frame(panel, low[:, first + 1], high[:, first + 2])
            panel.set_ylabel(ANSWER_COLUMNS[quantity][2])
            if not number:
                legend_title = "blue: may be used,\nwith its 95 % band;\ngrey: in doubt"
                key = panel.legend([], [], title=legend_title, title_fontsize="small", **LEGEND_PLACE)
                key.get_title().set_color(MUTED_COLOR)
        if self._alone:
            panel = next(axes)
            _trace(panel, time, low[:, -1], high[:, -1], OK_COLOR, "")
            panel.set_ylabel("frequency\n(Hz)")
        if self._quantities:
            self._draw_codes(next(axes), time, high)

    def _draw_codes(self, axes: Axes, time: np.ndarray, high: np.ndarray) -> None:
        """A strip for each quantity, in the colour of the worst code of each bin."""
        shades = {number: OK_COLOR if number < _RANK else REMARK_COLOR for number in self._codes.values()}
        doubts = [number for number in self._codes.values() if number >= 2 * _RANK]
        shades |= {number: DOUBT_COLORS[k % len(DOUBT_COLORS)] for k, number in enumerate(doubts)}
        edges = np.append(time, time[-1] + (time[-1] - time[0]) / max(len(time) - 1, 1))
        first, present = 1 + len(self._gauges) + len(self._optional), set()
        for strip, _quantity in enumerate(self._quantities):
            codes = high[:, first + LOG_QUANTITY_COLUMNS * strip + CODE_COLUMN].astype(int)
            starts = np.flatnonzero(np.diff(codes, prepend=-1))
            spans = [(edges[a], edges[b] - edges[a]) for a, b in zip(starts, [*starts[1:], len(codes)], strict=True)]
            height = strip - 0.5 * STRIP_BAR_HEIGHT, STRIP_BAR_HEIGHT
            axes.broken_barh(spans, height, facecolors=[shades[codes[start]] for start in starts])
            present |= {*codes.tolist()}
        strips = len(self._quantities)
        axes.set(ylim=(strips - 0.5, -0.5), yticks=range(strips), xlim=(edges[0], edges[-1]))
        axes.set_yticklabels(self._quantities)
        axes.grid(visible=False)
        keys: list[Any] = [Patch(color=shades[n], label=code) for code, n in self._codes.items() if n in present]
        axes.legend(handles=keys, **LEGEND_PLACE)


def _trace(axes: Axes, time: np.ndarray, low: np.ndarray, high: np.ndarray, color: str, label: str) -> None:
    """A curve, drawn as the area between its lowest and highest value in each bin."""
    axes.fill_between(time, low, high, color=color, alpha=0.45, linewidth=0)
    axes.plot(time, 0.5 * (low + high), color=color, linewidth=THIN_PT, label=named(label))


def _widen(axes: Axes) -> None:
    """Limits of a tenth around a quantity that was held constant, of which the axis would show the rounding."""
    low, high = axes.dataLim.intervaly
    size = max(abs(low), abs(high))
    if high - low < ROUNDING_CHANGE * size:
        axes.set_ylim(low - CONSTANT_LIMITS * size, high + CONSTANT_LIMITS * size)


def _frame(axes: Axes, low: np.ndarray, high: np.ndarray) -> None:
    """Limits that show nearly all bands: a few wide ones at the beginning would hide the others."""
    finite = np.isfinite(low) & np.isfinite(high)
    if finite.any():
        bottom, top = np.percentile(low[finite], CUT_PER_CENT), np.percentile(high[finite], PER_CENT - CUT_PER_CENT)
        room = LIMIT_ROOM * (top - bottom) + ROUNDING_SHARE
        axes.set_ylim(bottom - room, top + room)


def _draw_spectrum(axes: Axes, spectrum: Any) -> None:
    positive = spectrum.wavenumber_per_mm > 0
    wavelength, power = 1 / spectrum.wavenumber_per_mm[positive], spectrum.power[positive]
    starts = np.arange(0, len(power), max(1, len(power) // SPECTRUM_POINTS))
    highest = np.maximum.reduceat(power, starts)
    axes.fill_between(wavelength[starts], 0.0, highest, color=MUTED_COLOR, linewidth=0, step="post")
    below, above = SPECTRUM_MARGINS
    axes.set(
        xscale="log", yscale="log", xlabel="wavelength (mm)", ylabel="spectrum over\nthe path",
        xlim=(float(wavelength.min()), float(wavelength.max())),
        ylim=(max(float(np.median(power)) / below, LEAST_POWER), above * float(power.max())),
    )  # fmt: skip
    plain_log(axes.xaxis)
    distance, named = NAME_DISTANCE * math.log(wavelength.max() / wavelength.min()), list[float]()
    for line in spectrum.lines[:MOST_NAMES]:
        place = math.log(line.wavelength_mm)
        if any(abs(place - neighbour) < distance for neighbour in named):
            continue
        named.append(place)
        peak = float(power[np.argmin(np.abs(wavelength - line.wavelength_mm))])
        axes.annotate(
            f"{line.wavelength_mm:.4g} mm", (line.wavelength_mm, peak), xytext=(0, NAME_LIFT_PT),
            textcoords="offset points",
            ha="center", fontsize="small", color=OK_COLOR if line.harmonic == 1 else MUTED_COLOR,
        )  # fmt: skip
