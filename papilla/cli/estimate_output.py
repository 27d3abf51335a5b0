"""The summary of `papilla estimate`: spectral lines of the whole log, last answers, what became of the rows."""

from collections import Counter
from typing import TYPE_CHECKING

from papilla.cli.output import print_table, tell
from papilla.errors import InputError

if TYPE_CHECKING:
    from papilla.logs import TimeLog

LAST = {
    "last_answer": ("modulus_MPa", "modulus_sigma_MPa"),
    "last_wavelength": ("wavelength_mm", "wavelength_sigma_mm"),
    "last_frequency": ("frequency_Hz",),
    "last_friction": ("mu_kinetic", "mu_static"),
}
"""Keys of the last answers: each is the last row with a value in the first of its columns."""


MOST_STATUSES = 12
"""Statuses in the table; the JSON has all."""
_ANSWERS = (
    ("last_answer", "modulus", "MPa"),
    ("last_frequency", "frequency", "Hz"),
    ("last_wavelength", "wavelength", "mm"),
    ("last_friction", "friction, kinetic and static", ""),
)


def summary_of(recorded: "TimeLog", columns: dict, messages: tuple[str, ...], wavelengths) -> dict:
    """What is printed of the estimates: JSON keys and their values, `messages` among them."""
    report = recorded.report
    told = [*messages, *report.notes]
    lines, searched = _lines(recorded, wavelengths, told)
    if wavelengths is None and lines:
        told += _beyond_rows(lines[0]["wavelength_mm"])
    return {
        "rows": report.rows,
        "answered_rows": {names[0]: int((columns[names[0]] == columns[names[0]]).sum()) for names in LAST.values()},
        "status": dict(Counter(columns["status"]).most_common()),
        **{key: _last(recorded, columns, names) for key, names in LAST.items()},
        "lines": lines,
        "searched_mm": searched,
        "nan_rows": report.nan_rows,
        "nan_cells": report.nan_cells,
        "gaps": report.gaps,
        "duplicates": report.duplicates,
        "sample_rate_Hz": recorded.sample_rate_Hz,
        "messages": told,
    }


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


def _last(recorded: "TimeLog", columns: dict, names: tuple[str, ...]) -> dict | None:
    """The last row with a value in the first column, or None."""
    rows = (columns[names[0]] == columns[names[0]]).nonzero()[0]
    if not rows.size:
        return None
    row = rows[-1]
    return {"t_s": float(recorded.t_s[row])} | {name: float(columns[name][row]) for name in names}


def _lines(recorded: "TimeLog", wavelengths, told: list[str]) -> tuple[list[dict], list[float] | None]:
    """Significant lines of the whole log, strongest first, and the wavelengths (mm) that were searched."""
    if recorded.velocity_mm_s is None and recorded.position_mm is None:
        return [], None
    import numpy as np

    from papilla.estimators.lines import find_lines, latest_stretch
    from papilla.estimators.pipeline import path

    place = np.array(path(recorded.sample_rate_Hz, recorded.t_s.tolist(), recorded.velocity_mm_s, recorded.position_mm))
    try:
        first = latest_stretch(place, wavelengths)
        found = find_lines(place[first:], recorded.readings[first:], wavelength_range_mm=wavelengths)
    except InputError as error:
        told.append(f"no lines: {error}")
        return [], None
    if first:
        told.append(f"lines: of the log from {recorded.t_s[first]:.6g} s on; a longer path is not searched at once")
    names = recorded.gauge_names
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
        }
        for line in found.lines
    ]
    return lines, list(found.searched_mm)


def print_summary(summary: dict) -> None:
    """The summary as a table on stdout."""
    rows = [
        ("rows", str(summary["rows"]), ""),
        *((status, str(count), "rows") for status, count in list(summary["status"].items())[:MOST_STATUSES]),
        ("rows without a number in a cell", str(summary["nan_rows"]), ""),
        ("gaps", str(summary["gaps"]), ""),
        ("repeated times", str(summary["duplicates"]), ""),
        ("sampling rate", f"{summary['sample_rate_Hz']:.5g}", "Hz"),
    ]
    if (hidden := len(summary["status"]) - MOST_STATUSES) > 0:
        rows.insert(1 + MOST_STATUSES, ("other statuses", str(hidden), ""))
    if summary["force_noise_N"] is not None:
        rows += [
            ("noise of a gauge", f"{summary['gauge_noise_microstrain']:.3g}", "µε"),
            ("noise of the force", f"{summary['force_noise_N']:.2g}", "N"),
        ]
    rows += [row for key, words, unit in _ANSWERS if (row := _answer(summary[key], words, unit))]
    for line in summary["lines"]:
        found = f"{line['wavelength_mm']:.5g} ± {line['wavelength_sigma_mm']:.2g}"
        order = f"harmonic {line['harmonic']} of {line['fundamental_mm']:.4g} mm" if line["harmonic"] > 1 else "line"
        rows.append((f"{order}, strength {line['strength']:.3g}", found, "mm"))
    print_table(rows)
    tell(f"Wrote {summary['estimates']}")


def _answer(last: dict | None, words: str, unit: str) -> tuple[str, str, str] | None:
    """One row of the table for a last answer."""
    if last is None:
        return None
    time, *values = last.values()
    between = " ± " if unit else ", "
    return f"{words} at {time:.4g} s", between.join(f"{value:.4g}" for value in values), unit
