"""The summary of `papilla estimate` on the terminal: results first, then properties of the log, then the meaning of the
codes."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from papilla.cli.estimate_output import FREQUENCY_ALONE, LAST
from papilla.cli.output import json_text, plain, print_json, say, show_table, tell
from papilla.units import PER_CENT

if TYPE_CHECKING:
    from papilla.estimators.lines import LineSpectrum
    from papilla.view.log_picture import LogPicture

HEADS = ("quantity", "last value", "95 % interval", "ok", "why not the others")
REMARKS = 3
"""Largest number of remarks on the terminal; the file next to the estimates has all."""
REASONS = 2
"""Number of codes, the most frequent ones, that explain rows without an answer for a quantity."""
SIGMAS = 1.96
"""Half width of a 95 % interval, in standard deviations."""


def show(summary: dict, notes: Sequence[str], as_json: bool) -> None:
    """Write the summary to the file next to the estimates, and to stdout unless that has the estimates; write notes on
    the log, and advice, to stderr."""
    from papilla.files import write_text

    if summary["summary"] is None:
        for line in legend(summary):
            say(line)
    else:
        write_text(summary["summary"], json_text(summary))
        print_json(summary) if as_json else print_summary(summary)
    for text in (*notes, *_first(summary)):
        say(text)
    if (more := summary["remarks"] - REMARKS) > 0:
        say(f"{more} more remarks" + (f" in {summary['summary']}" if summary["summary"] else ""))


def print_summary(summary: dict) -> None:
    """The summary as a table, some lines and a legend on stdout."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    table = Table(*HEADS, box=SIMPLE_HEAD, pad_edge=False)
    for column in table.columns[:4]:
        column.no_wrap = True
    for row in [*_results(summary), *_lines(summary)]:
        table.add_row(*(Text(plain(cell)) for cell in row))
    show_table(table)
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
    from papilla.files import write_text
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
                heads=HEADS,
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
    return summary["messages"][: min(REMARKS, summary["remarks"])]


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
    for key, (quantity, unit, names) in LAST.items():
        found, why = summary[key] or {}, _why_not(summary, quantity)
        parts = ("kinetic friction", "static friction") if quantity == "friction" and found else (quantity,)
        for part, (value_name, sigma_name) in zip(
            parts, zip(names[::2], [*names[1::2], ""], strict=False), strict=False
        ):
            value, sigma = found.get(value_name, math.nan), found.get(sigma_name, math.nan)
            shown = f"{value:.4g} {unit}".strip() if value == value else "-"
            interval = f"{value - SIGMAS * sigma:.4g} to {value + SIGMAS * sigma:.4g}" if sigma == sigma else ""
            rows.append((part, shown, interval, _share(summary["ok_rows"][quantity], summary), why))
    return rows


def _why_not(summary: dict, quantity: str) -> str:
    """The most frequent codes of the rows of a quantity that are not ok, with their share."""
    codes = summary["statuses"][quantity].items()
    reasons = [(code, rows) for code, rows in codes if not code.startswith("ok") and code != FREQUENCY_ALONE]
    if reasons and reasons[0][1] == summary["rows"]:
        return reasons[0][0]
    return ", ".join(f"{code} {_share(rows, summary)}" for code, rows in reasons[:REASONS])


def _lines(summary: dict) -> list[tuple[str, ...]]:
    """One row for each line of the whole log that agrees with rows, strongest first."""
    return [
        (
            "line of the log",
            f"{line['wavelength_mm']:.5g} mm",
            f"{line['wavelength_mm'] - SIGMAS * line['wavelength_sigma_mm']:.6g} to "
            f"{line['wavelength_mm'] + SIGMAS * line['wavelength_sigma_mm']:.6g}",
            _share(line["ok_rows"], summary),
            f"strength {line['strength']:.3g}"
            + (f", harmonic {line['harmonic']} of {line['fundamental_mm']:.4g} mm" if line["harmonic"] > 1 else ""),
        )
        for line in summary["lines"]
        if line["ok_rows"]
    ]


def _share(rows: int, summary: dict) -> str:
    return f"{PER_CENT * rows / max(summary['rows'], 1):.3g} %"
