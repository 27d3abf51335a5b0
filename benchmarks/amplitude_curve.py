"""g_A, the power that the sensor hears against the wavelength: `papilla/data/amplitude_curve.json`.

Run with `python benchmarks/amplitude_curve.py` (two minutes); `--write` writes the file. The default finger slides over
gratings with groove = ridge at a depth of 1 mm, 40 mm/s, without friction; the power of the fundamental of each gauge
is over its greatest, and the mean of the five is kept.
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import typer

import papilla
from papilla.core.files import write_text
from papilla.model.finger import Finger
from papilla.telepresence.amplitude import AMPLITUDE_SCHEMA, read_curve
from papilla_papers.grating_signals import signals_over_gratings

WAVELENGTHS_MM = tuple(np.round(np.arange(0.8, 2.05, 0.1), 1).tolist())
SPEED_MM_S, DEPTH_MM, LENGTH_MM = 40.0, 1.0, 7.0
"""Of the 2011 paper: a depth of 1 mm, a speed inside the tested range. Length along y: powers do not depend on it."""
FILE = Path(papilla.__file__).parent / "data" / "amplitude_curve.json"


def powers(wavelengths_mm: Sequence[float]) -> list[float]:
    """Mean power of the gauges, each over its greatest, at some wavelengths."""
    finger = Finger.default()
    assert finger.ridges is not None
    found = signals_over_gratings(
        finger, wavelengths_mm, pitches_mm=(finger.ridges.pitch,), speed_mm_s=SPEED_MM_S, force=None, depth=DEPTH_MM,
        friction=0.0, length_mm=LENGTH_MM, progress=print,
    )  # fmt: skip
    squares = np.array([one.fundamental**2 for one in found])
    return np.round((squares / squares.max(axis=0)).mean(axis=1), 4).tolist()


def main(write: bool = False, wavelengths: list[float] | None = None) -> None:
    """Compute (some wavelengths alone), compare with the file, and write it if asked to."""
    if write and wavelengths:
        raise typer.BadParameter("the file has all wavelengths")
    chosen = tuple(wavelengths or WAVELENGTHS_MM)
    power, curve = powers(chosen), read_curve()
    shipped = dict(zip(curve.wavelength_mm, curve.power, strict=True))
    for wavelength, one in zip(chosen, power, strict=True):
        print(f"{wavelength:.1f} mm: {one:.4f}, shipped {shipped[wavelength]:.4f}")
    if write:
        source = (
            "default finger on gratings with groove = ridge, depth held at 1 mm, 40 mm/s, no friction; power of the "
            "fundamental, each gauge over its greatest, mean of the five: python benchmarks/amplitude_curve.py --write"
        )
        content = {"schema": AMPLITUDE_SCHEMA, "source": source, "wavelength_mm": WAVELENGTHS_MM, "power": power}
        write_text(FILE, json.dumps(content, indent=2) + "\n")


if __name__ == "__main__":
    typer.run(main)
