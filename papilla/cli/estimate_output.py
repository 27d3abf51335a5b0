"""The summary of `papilla estimate`: what rows call ok, with counts, and the lines of the whole log that agree with it.

A line that stands out of the whole log but that no row calls ok is no result: it may be of time (hum, a motor), or made
by a wrong unit. The JSON has it, with `ok_rows` 0.
"""

import math
from collections import Counter, deque
from collections.abc import Sequence
from typing import TYPE_CHECKING

from papilla.cli.output import print_table, tell
from papilla.errors import InputError

if TYPE_CHECKING:
    import numpy as np

    from papilla.estimators import PipelineEstimate
    from papilla.logs import TimeLogFile

LAST = {
    "last_answer": ("modulus", "MPa", ("modulus_MPa", "modulus_sigma_MPa")),
    "last_frequency": ("frequency", "Hz", ("frequency_Hz",)),
    "last_wavelength": ("wavelength", "mm", ("wavelength_mm", "wavelength_sigma_mm")),
    "last_friction": ("friction", "", ("mu_kinetic", "mu_kinetic_sigma", "mu_static", "mu_static_sigma")),
}
"""Keys of the last answers: quantity, unit and columns; each is of the last row whose status of the quantity is ok."""
ADVICE = {
    "modulus": "state the thickness (--thickness), press harder and hold the press",
    "wavelength": "slide over a longer path at changing speed, which tells a texture from hum and motors, and look at "
    "the units of t_s, velocity_mm_s and position_mm",
    "friction": "slide both ways, and lift the finger off for half a second, which tells the zero of tangential_N",
}
"""What to do where no row of a quantity is ok."""
CONSTANT_SPEED = "ok, constant speed"
ALIKE = 0.02
"""Relative difference up to which the wavelength of a row is that of a line of the whole log."""

LONGEST_ROWS = 2**20  # Rows that spectral lines are looked for in at once: 17 minutes at 1 kHz
MOST_STATUSES = 12  # Statuses in the table; the JSON has all


class Summary:
    """The summary of a log and its estimates, gathered block by block in bounded memory.

    Of the rows the lines are looked for in, the latest `LONGEST_ROWS` are kept.
    """

    def __init__(self, recorded: "TimeLogFile"):
        from papilla.estimators.pipeline.clock import Clock

        self._log, self._columns = recorded, ("t_s", *recorded.gauge_names, *recorded.optional)
        self._clock = Clock(recorded.sample_rate_Hz)
        self._tail: deque[tuple[np.ndarray, np.ndarray]] = deque()
        self._statuses: Counter[str] = Counter()
        self._answered = {names[0]: 0 for *_, names in LAST.values()}
        self._own: dict[str, Counter[str]] = {name: Counter() for name, *_ in LAST.values()}
        self._wavelengths: Counter[int] = Counter()
        self._last: dict[str, dict | None] = dict.fromkeys(LAST)
        self.rows = self._kept = 0

    def add(self, block: "np.ndarray", answer: "PipelineEstimate") -> None:
        """Take in the next rows of the log and their answers."""
        self.rows += len(block)
        self._statuses.update(answer.status)
        for key, (quantity, _, names) in LAST.items():
            values = getattr(answer, names[0])
            self._answered[names[0]] += int((values == values).sum())
            sentences = self._sentences(quantity, answer)
            self._own[quantity].update(sentences)
            usable = [row for row, text in enumerate(sentences) if text.startswith("ok") and values[row] == values[row]]
            if usable:
                last = {name: float(getattr(answer, name)[usable[-1]]) for name in names}
                self._last[key] = {"t_s": float(block[usable[-1], 0])} | last
            if quantity == "wavelength":
                self._wavelengths.update(round(math.log(value) / ALIKE) for value in values[usable].tolist())
        if {"velocity_mm_s", "position_mm"} & {*self._columns}:
            self._keep(block)

    def _sentences(self, quantity: str, answer: "PipelineEstimate") -> Sequence[str]:
        """The status of each row for a quantity; without a path that of a frequency stands among the others only."""
        if quantity != "frequency":
            return getattr(answer, f"{quantity}_status")
        if {"velocity_mm_s", "position_mm"} & {*self._columns}:
            return answer.wavelength_status
        return ["frequency is in doubt" if "frequency:" in text else "ok" for text in answer.status]

    def _keep(self, block: "np.ndarray") -> None:
        """Keep the rows and where they are on the path, as long as they may be needed."""
        import numpy as np

        from papilla.estimators.pipeline import path

        velocity, position = (
            block[:, self._columns.index(name)].tolist() if name in self._columns else None
            for name in ("velocity_mm_s", "position_mm")
        )
        self._tail.append((block, np.array(path(self._clock, block[:, 0].tolist(), velocity, position))))
        self._kept += len(block)
        while self._kept - len(self._tail[0][0]) >= LONGEST_ROWS:
            self._kept -= len(self._tail.popleft()[0])

    def finish(self, messages: tuple[str, ...], wavelengths: tuple[float, float] | None) -> dict:
        """What is printed: JSON keys and their values, `messages` among them."""
        report = self._log.report
        remarks = [*messages, *report.notes]
        lines, searched = self._lines(wavelengths, remarks)
        if wavelengths is None and lines:
            remarks += _beyond_rows(lines[0]["wavelength_mm"])
        own = {
            quantity: sum(n for text, n in of.items() if text.startswith("ok")) for quantity, of in self._own.items()
        }
        remarks += self._remarks(own, lines)
        return {
            "rows": report.rows,
            "answered_rows": self._answered,
            "ok_rows": own,
            "status": dict(self._statuses.most_common()),
            **self._last,
            "lines": lines,
            "searched_mm": searched,
            "nan_rows": report.nan_rows,
            "nan_cells": report.nan_cells,
            "gaps": report.gaps,
            "duplicates": report.duplicates,
            "sample_rate_Hz": self._log.sample_rate_Hz,
            "messages": remarks,
        }

    def _remarks(self, ok_rows: dict[str, int], lines: list[dict]) -> list[str]:
        """One line for each result that is none or in doubt: why, and what to do."""
        remarks = []
        if doubted := [line["wavelength_mm"] for line in lines if not line["ok_rows"] and line["harmonic"] == 1]:
            remarks.append(
                f"lines: {len(doubted)} of the whole log, the strongest {doubted[0]:.5g} mm, are ok in no row: they "
                "may be of time instead of the surface. To do: look at wavelength_status; --json lists them"
            )
        if steady := sum(n for text, n in self._own["wavelength"].items() if text.startswith(CONSTANT_SPEED)):
            remarks.append(
                f"wavelength: {steady} of the {ok_rows['wavelength']} ok rows are of a constant speed, where a "
                "vibration of that frequency is not excluded. To do: change the speed"
            )
        for quantity, advice in ADVICE.items():
            most = self._own[quantity].most_common(1)
            if most and not ok_rows[quantity] and not most[0][0].startswith(f"no {quantity}:"):
                remarks.append(f"{quantity}: no row is ok, most often because: {most[0][0]}. To do: {advice}")
        return remarks

    def _lines(
        self, wavelengths: tuple[float, float] | None, remarks: list[str]
    ) -> tuple[list[dict], list[float] | None]:
        """Significant lines of the kept rows, strongest first, and the wavelengths (mm) that were searched."""
        if not self._tail:
            return [], None
        import numpy as np

        from papilla.estimators.lines import find_lines, latest_stretch

        names = self._log.gauge_names
        rows, place = (np.concatenate(parts)[-LONGEST_ROWS:] for parts in zip(*self._tail, strict=True))
        self._tail.clear()
        try:
            first = latest_stretch(place, wavelengths)
            found = find_lines(place[first:], rows[first:, 1 : 1 + len(names)], wavelength_range_mm=wavelengths)
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
                "ok_rows": sum(self._wavelengths[round(math.log(line.fundamental_mm) / ALIKE) + k] for k in (-1, 0, 1)),
            }
            for line in found.lines
        ]
        return lines, list(found.searched_mm)


def _beyond_rows(strongest_mm: float) -> list[str]:
    """A word where the strongest line of the log is none that is looked for row by row."""
    from papilla.estimators.pipeline.pipeline import DEFAULT_RANGE_MM

    low, high = DEFAULT_RANGE_MM
    if low <= strongest_mm <= high:
        return []
    return [
        f"the strongest line, {strongest_mm:.3g} mm, is outside the {low:g} to {high:g} mm of the rows: give "
        "--wavelength-range, or, if it cannot be, look at the units of t_s, velocity_mm_s and position_mm"
    ]


def print_summary(summary: dict) -> None:
    """The summary as a table on stdout."""
    rows: list[tuple[str, str, str]] = []
    for key, (quantity, unit, _) in LAST.items():
        if summary[key] is not None:
            time, *values = summary[key].values()
            counted = f"last of {summary['ok_rows'][quantity]} ok rows, at {time:.4g} s"
            parts = ("kinetic ", "static ") if quantity == "friction" else ("",)
            for number, part in enumerate(parts):
                shown = [f"{value:.4g}" for value in values[2 * number : 2 * number + 2] if value == value]
                if shown:
                    rows.append((f"{part}{quantity}, {counted}", " ± ".join(shown), unit))
    for line in summary["lines"]:
        if line["ok_rows"]:
            found = f"{line['wavelength_mm']:.5g} ± {line['wavelength_sigma_mm']:.2g}"
            whole = f"line of the whole log, as {line['ok_rows']} ok rows"
            order = f"harmonic {line['harmonic']} of {line['fundamental_mm']:.4g} mm" if line["harmonic"] > 1 else whole
            rows.append((f"{order}, strength {line['strength']:.3g}", found, "mm"))
    if not rows:
        rows.append(("no row has an answer that is ok", "", ""))
    rows += [
        ("rows", str(summary["rows"]), ""),
        *((status, str(count), "rows") for status, count in list(summary["status"].items())[:MOST_STATUSES]),
    ]
    if (hidden := len(summary["status"]) - MOST_STATUSES) > 0:
        rows.append(("other statuses", str(hidden), ""))
    rows += [
        ("rows without a number in a cell", str(summary["nan_rows"]), ""),
        ("gaps", str(summary["gaps"]), ""),
        ("repeated times", str(summary["duplicates"]), ""),
        ("sampling rate", f"{summary['sample_rate_Hz']:.5g}", "Hz"),
    ]
    if summary["force_noise_N"] is not None:
        rows += [
            ("noise of a gauge", f"{summary['gauge_noise_microstrain']:.3g}", "µε"),
            ("noise of the force", f"{summary['force_noise_N']:.2g}", "N"),
        ]
    print_table(rows)
    tell(f"Wrote {summary['estimates']}")
