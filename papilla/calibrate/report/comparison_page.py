"""The page of a comparison: verdicts, a table, maps of the uncertainty of E, receptive fields."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from markupsafe import Markup

from papilla import view
from papilla.calibrate.comparison import FORCE_ERROR, NOISE_MICROSTRAIN, SCENE, Candidate, Comparison
from papilla.files import write_text
from papilla.finger import Finger
from papilla.tables import write_table
from papilla.view.page import either, environment, image
from papilla.view.pictures import receptive_of


def write_comparison(path: str | Path, found: Comparison, candidates: Sequence[Candidate]) -> None:
    """Write the page of a comparison as one HTML file: no script, no link; raises `FileAccessError`."""
    maps = [
        view.plots.uncertainty_map(found.force_N, found.modulus_MPa, row.relative_sigma, row.relative_sigma <= 0.5)
        for row in found.rows
    ]
    text = environment("papilla.calibrate.report").get_template("comparison.html").render(
        rows=found.rows, verdicts=found.verdicts, scene=SCENE, noise=NOISE_MICROSTRAIN, force_error=FORCE_ERROR,
        force_N=found.force_N, modulus_MPa=found.modulus_MPa,
        maps=[image(figure, f"Uncertainty of E of {row.name}") for figure, row in zip(maps, found.rows, strict=True)],
        fields=[one.finger and _fields(one.finger, one.name) for one in candidates],
    )  # fmt: skip
    write_text(path, text)


def _fields(finger: Finger, name: str) -> Markup:
    """Receptive fields of a finger's gauges."""
    found = receptive_of(finger)
    pictures = (view.png(view.receptive_fields_figure(found, finger, small=small), 120) for small in (False, True))
    return either(pictures, f"Receptive fields of {name}", "png")


def write_comparison_table(path: str | Path, found: Comparison) -> None:
    """Write the figures of each candidate as CSV, a row each; raises `FileAccessError`."""
    rows = [row.to_json() for row in found.rows]
    columns = {key: [row[key] for row in rows] for key in rows[0] if key != "reach"}
    columns["press_ms"] = [np.nan if value is None else value for value in columns["press_ms"]]
    areas = [[reach.area_mm2 for reach in row.reach] for row in found.rows]
    columns["median_field_mm2"] = [float(np.median(of)) if of else np.nan for of in areas]
    write_table(path, columns)
