"""The summary of `papilla estimate` on the terminal: results first, then properties of the log, then the meaning of the
codes."""

import math
from collections import Counter, defaultdict, deque
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from papilla.cli.output import json_text, print_json, say, show_table, tell
from papilla.core.errors import InputError
from papilla.core.units import PER_CENT

if TYPE_CHECKING:
    import numpy as np

    from papilla.estimators import Pipeline, PipelineEstimate
    from papilla.estimators.wavelength.lines import LineSpectrum
    from papilla.logs import TimeLogFile
    from papilla.view.log_picture import LogPicture

SUMMARY_HEADS = ("quantity", "last value", "95 % interval", "ok", "why not the others")
MOST_REMARKS = 3
"""Largest number of remarks on the terminal; the file next to the estimates has all."""
MOST_REASONS = 2
"""Number of codes, the most frequent ones, that explain rows without an answer for a quantity."""
INTERVAL_SIGMAS = 1.96
"""Half width of a 95 % interval, in standard deviations."""
LAST_ANSWERS = {
    "last_answer": ("modulus", "MPa", ("modulus_MPa", "modulus_sigma_MPa")),
    "last_frequency": ("frequency", "Hz", ("frequency_Hz",)),
    "last_wavelength": ("wavelength", "mm", ("wavelength_mm", "wavelength_sigma_mm")),
    "last_friction": ("friction", "", ("mu_kinetic", "mu_kinetic_sigma", "mu_static", "mu_static_sigma")),
}
"""Keys of the last answers: quantity, unit and columns; each value is from the last row whose status is ok for the
quantity."""
QUANTITY_ADVICE = {
    "modulus": "state the thickness (--thickness), press harder and hold the press",
    "wavelength": "slide over a longer path at changing speed, which separates a texture from hum and motors, and look "
    "at the units of t_s, velocity_mm_s and position_mm",
    "friction": "slide both ways, and lift the finger off for half a second, which shows the zero of tangential_N",
}
"""Advice if no row of a quantity is ok."""
FREQUENCY_ALONE = "frequency alone"
CONSTANT_SPEED = "ok, constant speed"
ALIKE_WAVELENGTHS = 0.02
"""Relative difference of wavelength up to which a row agrees with a line of the whole log."""

LONGEST_ROWS = 2**19  # Number of rows in which spectral lines are searched at once: 9 minutes at 1 kHz


def show(summary: dict, notes: Sequence[str], as_json: bool) -> None:
    """Write the summary to the file next to the estimates, and to stdout unless that has the estimates; write notes on
    the log, and advice, to stderr."""
    from papilla.core.files import write_text

    if summary["summary"] is None:
        for line in legend(summary):
            say(line)
    else:
        write_text(summary["summary"], json_text(summary))
        print_json(summary) if as_json else print_summary(summary)
    for text in (*notes, *_first(summary)):
        say(text)
    if (more := summary["remarks"] - MOST_REMARKS) > 0:
        say(f"{more} more remarks" + (f" in {summary['summary']}" if summary["summary"] else ""))


def print_summary(summary: dict) -> None:
    """The summary as a table, some lines and a legend on stdout."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(*SUMMARY_HEADS, box=SIMPLE_HEAD, pad_edge=False)
    for column in table.columns[:4]:
        column.no_wrap = True
    show_table(table, [*_results(summary), *_lines(summary)])
    tell(_counts(summary))
    for line in legend(summary):
        tell(line)
    tell(f"Wrote {summary['estimates']}, and this summary in full: {summary['summary']}")


def write_pictures(
    summary: dict,
    notes: Sequence[str],
    picture: "LogPicture",
    spectrum: "LineSpectrum | None",
    plot: Path | None,
    page: Path | None,
) -> None:
    """The picture of the log and its estimates (png, pdf or svg), and a page of the summary with this picture."""
    from papilla.core.files import write_text
    from papilla.view.page import environment, image
    from papilla.view.style import content, kind_of, write_bytes

    rows = [*_results(summary), *_lines(summary)]
    answers = "; ".join(
        f"{name} {value} ({interval})" for name, value, interval, *_ in _results(summary)[:4] if interval
    )
    figure = picture.figure(Path(summary["log"]).name, answers or "no row has an answer that is ok", spectrum)
    if plot is not None:
        write_bytes(plot, content(figure, kind_of(plot)))
    if page is not None:
        text = (
            environment("papilla.view")
            .get_template("estimates.html")
            .render(
                log=summary["log"],
                counts=_counts(summary),
                heads=SUMMARY_HEADS,
                rows=rows,
                remarks=_first(summary),
                legend=legend(summary),
                notes=notes,
                picture=image(figure, "Readings, force, velocity, answers, statuses and the spectrum over the path"),
            )
        )
        write_text(page, text)


def _first(summary: dict) -> list[str]:
    """The remarks that are shown on the terminal."""
    return summary["messages"][: min(MOST_REMARKS, summary["remarks"])]


def _counts(summary: dict) -> str:
    """Words on the number of rows, their noise and their faults."""
    noise = ""
    if summary["force_noise_N"] is not None:
        noise = f", noise {summary['gauge_noise_microstrain']:.3g} µε and {summary['force_noise_N']:.2g} N"
    return (
        f"{summary['rows']} rows at {summary['sample_rate_Hz']:.5g} Hz{noise}; {summary['nan_rows']} rows without a "
        f"number in a cell, {summary['gaps']} gaps, {summary['duplicates']} repeated times"
    )


def legend(summary: dict) -> list[str]:
    """A line for each code that needs an explanation."""
    return [
        f"  {quantity}, {code}: {sentence}"
        for quantity, codes in summary["legend"].items()
        for code, sentence in codes.items()
        if sentence.removeprefix("ok, ") != code.removeprefix("ok, ")
    ]


def _results(summary: dict) -> list[tuple[str, ...]]:
    """One row for each quantity, two for friction."""
    rows: list[tuple[str, ...]] = []
    for key, (quantity, unit, names) in LAST_ANSWERS.items():
        answers, why = summary[key] or {}, _why_not(summary, quantity)
        parts = ("kinetic friction", "static friction") if quantity == "friction" and answers else (quantity,)
        for label, (value_name, sigma_name) in zip(
            parts, zip(names[::2], [*names[1::2], ""], strict=False), strict=False
        ):
            value, sigma = answers.get(value_name, math.nan), answers.get(sigma_name, math.nan)
            text = f"{value:.4g} {unit}".strip() if value == value else "-"
            interval = (
                f"{value - INTERVAL_SIGMAS * sigma:.4g} to {value + INTERVAL_SIGMAS * sigma:.4g}"
                if sigma == sigma
                else ""
            )
            rows.append((label, text, interval, _share(summary["ok_rows"][quantity], summary), why))
    return rows


def _why_not(summary: dict, quantity: str) -> str:
    """The most frequent codes of the rows of a quantity that are not ok, with their share."""
    codes = summary["statuses"][quantity].items()
    reasons = [(code, rows) for code, rows in codes if not code.startswith("ok") and code != FREQUENCY_ALONE]
    if reasons and reasons[0][1] == summary["rows"]:
        return reasons[0][0]
    return ", ".join(f"{code} {_share(rows, summary)}" for code, rows in reasons[:MOST_REASONS])


def _lines(summary: dict) -> list[tuple[str, ...]]:
    """One row for each line of the whole log that agrees with rows, strongest first."""
    return [
        (
            "line of the log",
            f"{line['wavelength_mm']:.5g} mm",
            f"{line['wavelength_mm'] - INTERVAL_SIGMAS * line['wavelength_sigma_mm']:.6g} to "
            f"{line['wavelength_mm'] + INTERVAL_SIGMAS * line['wavelength_sigma_mm']:.6g}",
            _share(line["ok_rows"], summary),
            f"strength {line['strength']:.3g}"
            + (f", harmonic {line['harmonic']} of {line['fundamental_mm']:.4g} mm" if line["harmonic"] > 1 else ""),
        )
        for line in summary["lines"]
        if line["ok_rows"]
    ]


def _share(rows: int, summary: dict) -> str:
    return f"{PER_CENT * rows / max(summary['rows'], 1):.3g} %"


class Summary:
    """The summary of a log and its estimates.

    The latest `LONGEST_ROWS` rows are kept for the search for lines.
    """

    def __init__(self, recorded: "TimeLogFile", pipeline: "Pipeline"):
        self._log, self._pipeline = recorded, pipeline
        self._columns = ("t_s", *recorded.gauge_names, *recorded.optional)
        self._moves = bool({"velocity_mm_s", "position_mm"} & {*recorded.optional})
        self._tail: deque[np.ndarray] = deque()
        # Each combination of the three codes gets the next number when it first occurs: a row needs one look-up.
        self._numbers: defaultdict[tuple[str, str, str], int] = defaultdict()
        self._numbers.default_factory = self._numbers.__len__
        self._counts = Counter[int]()
        self._answered = {names[0]: 0 for *_, names in LAST_ANSWERS.values()}
        self._wavelengths: Counter[int] = Counter()
        self._last: dict[str, dict | None] = dict.fromkeys(LAST_ANSWERS)
        self.rows = self._kept = 0
        self.spectrum: LineSpectrum | None = None

    def add(self, block: "np.ndarray", answer: "PipelineEstimate") -> list[str]:
        """Add the next rows of the log and their answers; returns the worst code of each row."""
        import numpy as np

        self.rows += len(block)
        codes = zip(answer.modulus_status, answer.wavelength_status, answer.friction_status, strict=True)
        numbers = np.fromiter(map(self._numbers.__getitem__, codes), int, len(block))
        self._counts.update(numbers.tolist())
        for key, (quantity, _, names) in LAST_ANSWERS.items():
            values = np.asarray(getattr(answer, names[0]))
            present = values == values
            self._answered[names[0]] += int(present.sum())
            ok = np.array([self._usable(quantity, number) for number in self._numbers])[numbers]
            usable = np.flatnonzero(ok & present)
            if len(usable):
                last = {name: float(getattr(answer, name)[usable[-1]]) for name in names}
                self._last[key] = {"t_s": float(block[usable[-1], 0])} | last
            if quantity == "wavelength":
                bins, counts = np.unique(np.rint(np.log(values[usable]) / ALIKE_WAVELENGTHS), return_counts=True)
                self._wavelengths.update(dict(zip(bins.astype(int).tolist(), counts.tolist(), strict=True)))
        if self._moves:
            self._tail.append(block)
            self._kept += len(block)
            while self._kept - len(self._tail[0]) >= LONGEST_ROWS:
                self._kept -= len(self._tail.popleft())
        return np.array([self._worst(number) for number in self._numbers], object)[numbers].tolist()

    def _code(self, quantity: str, codes: tuple[str, str, str]) -> str:
        """The code of a quantity; without a path the wavelength has the code of the frequency."""
        return codes[("modulus", "wavelength", "friction").index("wavelength" if quantity == "frequency" else quantity)]

    def _usable(self, quantity: str, codes: tuple[str, str, str]) -> bool:
        code = self._code(quantity, codes)
        return code.startswith("ok") or (quantity == "frequency" and code == FREQUENCY_ALONE)

    def _worst(self, codes: tuple[str, str, str]) -> str:
        """The worst of the three codes: a doubt or a fault, then a quantity that the log lacks, then ok."""
        off = {why.split(",")[0] for why in self._pipeline.off.values()}
        return max(codes, key=lambda code: (not code.startswith("ok") and (2 if code in off else 3)) or code != "ok")

    def check(self) -> None:
        """Raise `InputError` if no row has an answer and a column seems to be in another unit."""
        sizes = self._log.report.sizes
        ok = any(self._usable(quantity, number) for quantity, *_ in LAST_ANSWERS.values() for number in self._numbers)
        if sizes and not ok:
            raise InputError(f"{self._log.path}: no row has an answer that is ok; {sizes[0]}")

    def finish(self, wavelengths: tuple[float, float] | None) -> dict:
        """The summary: JSON keys and their values. `messages` are all messages, the most important first; the first
        `remarks` of them contain advice."""
        report, status = self._log.report, Counter[str]()
        statuses = {quantity: Counter[str]() for quantity, *_ in LAST_ANSWERS.values()}
        row_counts = dict.fromkeys(statuses, 0)
        for codes, number in self._numbers.items():
            count = self._counts[number]
            status[self._worst(codes)] += count
            for quantity, counts in statuses.items():
                counts[self._code(quantity, codes)] += count
                row_counts[quantity] += count * self._usable(quantity, codes)
        later: list[str] = []
        lines, searched = self._lines(wavelengths, later)
        doubts = [text for text in self._pipeline.notes if text.startswith("modulus: the calibration is in doubt")]
        remarks = [*doubts, *report.sizes, *self._unanswered(row_counts, statuses), *self._broken()]
        remarks += [
            *_of_lines(lines, wavelengths),
            *_of_speed(statuses["wavelength"], row_counts["wavelength"]),
            *later,
        ]
        notes = [text for text in (*self._pipeline.notes, *report.notes) if text not in remarks]
        return {
            "rows": report.rows,
            "answered_rows": self._answered,
            "ok_rows": row_counts,
            "status": dict(status.most_common()),
            "statuses": {quantity: dict(counts.most_common()) for quantity, counts in statuses.items()},
            "legend": self._pipeline.legend,
            "faults": self._pipeline.faults,
            **self._last,
            "lines": lines,
            "searched_mm": searched,
            "nan_rows": report.nan_rows,
            "nan_cells": report.nan_cells,
            "gaps": report.gaps,
            "duplicates": report.duplicates,
            "sample_rate_Hz": self._log.sample_rate_Hz,
            "messages": [*remarks, *notes],
            "remarks": len(remarks),
        }

    def _unanswered(self, ok_rows: dict[str, int], statuses: dict[str, Counter[str]]) -> list[str]:
        """A line for each running quantity that is ok in no row: the most frequent reason, and advice."""
        remarks = []
        for quantity, advice in QUANTITY_ADVICE.items():
            if statuses[quantity] and not ok_rows[quantity] and quantity not in self._pipeline.off:
                why = self._pipeline.legend[quantity][statuses[quantity].most_common(1)[0][0]]
                remarks.append(f"{quantity}: no row is ok, most often because: {why}. To do: {advice}")
        return remarks

    def _broken(self) -> list[str]:
        """A line on the gauges that were missing, saturated or stuck in some row."""
        names = {*self._log.gauge_names}
        broken = {text: rows for text, rows in self._pipeline.faults.items() if text.split(" ")[0].strip(",") in names}
        if not broken:
            return []
        listed = ", ".join(f"{text} in {rows} rows" for text, rows in [*broken.items()][:4])
        return [f"gauges: {listed}. To do: look at their wiring and the range of the amplifier"]

    def _lines(
        self, wavelengths: tuple[float, float] | None, remarks: list[str]
    ) -> tuple[list[dict], list[float] | None]:
        """Significant lines of the kept rows, strongest first, and the wavelengths (mm) that were searched."""
        if not self._tail:
            return [], None
        import numpy as np

        from papilla.estimators.wavelength.lines import find_lines, latest_stretch

        names = self._log.gauge_names
        rows = np.concatenate(self._tail)[-LONGEST_ROWS:]
        self._tail.clear()
        place = self._path(rows)
        try:
            first = latest_stretch(place, wavelengths)
            self.spectrum = spectrum = find_lines(
                place[first:], rows[first:, 1 : 1 + len(names)], wavelength_range_mm=wavelengths
            )
        except InputError as error:
            remarks.append(f"no lines: {error}")
            return [], None
        if first or len(rows) < self.rows:
            remarks.append(f"lines: of the log from {rows[first, 0]:.6g} s on; a longer path is not searched at once")
        lines = [
            {
                "wavelength_mm": line.wavelength_mm,
                "wavelength_sigma_mm": line.sigma_mm,
                "strength": line.amplitude,
                "power_over_background": line.ratio,
                "chance": line.chance,
                "harmonic": line.harmonic,
                "fundamental_mm": line.fundamental_mm,
                "gauges": [names[number] for number in line.channels],
                "ok_rows": sum(
                    self._wavelengths[round(math.log(line.fundamental_mm) / ALIKE_WAVELENGTHS) + k] for k in (-1, 0, 1)
                ),
            }
            for line in spectrum.lines
        ]
        return lines, list(spectrum.searched_mm)

    def _path(self, rows: "np.ndarray") -> "np.ndarray":
        """Position (n,) in mm along the path, from the rows' velocity or position."""
        import numpy as np

        from papilla.core.rows import BLOCK_ROWS
        from papilla.estimators.pipeline import path
        from papilla.estimators.pipeline.clock import Clock

        clock, names = Clock(self._log.sample_rate_Hz), ("velocity_mm_s", "position_mm")
        at = [self._columns.index(name) if name in self._columns else None for name in names]
        place = np.empty(len(rows))
        for first in range(0, len(rows), BLOCK_ROWS):
            # Numbers of Python take four times the memory of an array
            block = rows[first : first + BLOCK_ROWS]
            moved = (None if column is None else block[:, column].tolist() for column in at)
            place[first : first + BLOCK_ROWS] = path(clock, block[:, 0].tolist(), *moved)
        return place


def _of_lines(lines: list[dict], wavelengths: tuple[float, float] | None) -> list[str]:
    """Doubts about the lines of the whole log, and advice."""
    from papilla.estimators.pipeline.pipeline import DEFAULT_WAVELENGTHS_MM

    remarks, (low, high) = [], DEFAULT_WAVELENGTHS_MM
    if wavelengths is None and lines and not low <= (strongest := lines[0]["wavelength_mm"]) <= high:
        remarks.append(
            f"the strongest line, {strongest:.3g} mm, is outside the {low:g} to {high:g} mm of the rows: give "
            "--wavelength-range, or, if it cannot be, look at the units of t_s, velocity_mm_s and position_mm"
        )
    if doubted := [line["wavelength_mm"] for line in lines if not line["ok_rows"] and line["harmonic"] == 1]:
        remarks.append(
            f"lines: {len(doubted)} of the whole log, the strongest {doubted[0]:.5g} mm, are ok in no row: they "
            "may be of time instead of the surface. To do: look at wavelength_status; --json lists them"
        )
    return remarks


def _of_speed(codes: Counter[str], ok_rows: int) -> list[str]:
    """The doubt that a constant speed leaves, and advice."""
    steady = sum(rows for code, rows in codes.items() if code.startswith(CONSTANT_SPEED))
    return [
        f"wavelength: {steady} of the {ok_rows} ok rows are of a constant speed, where a vibration of that frequency "
        "is not excluded. To do: change the speed"
    ] * bool(steady)
