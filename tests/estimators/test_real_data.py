"""Real measurements: ridged boards and fabrics under a finger of 16 channels (FabricSlide, Wang et al. 2022).

They are not part of the project: looked for in $PAPILLA_DATA or in ../shared/data beside it, else skipped. The width
of a board's ridges is read from its file's name only to know what is right, never by an estimator.
"""

import os
import re
from pathlib import Path

import numpy as np
import pytest

from papilla.estimators import Pipeline
from papilla.estimators.wavelength.lines import find_lines, travelled

DATA = Path(os.environ.get("PAPILLA_DATA") or Path(__file__).parents[3] / "shared" / "data")
BOARDS = sorted((DATA / "fabricslide_board").glob("*.csv"))
FABRICS = sorted((DATA / "fabricslide_fabric").glob("*.csv"))
NAME = re.compile(r"(?P<what>[A-Za-z]+?)(?P<ridge>\d+mm)?_F(?P<press>\d+)_V-(?P<speed>\d+)mmps_(?P<repetition>\d+)")
TRUTH_MM = {"2mm": 3.99, "10mm": 19.88}
RANGES_MM = {"2mm": (1.0, 8.0), "10mm": (10.0, 40.0)}
TOLERANCE = {"2mm": 0.01, "10mm": 0.015}

boards = pytest.mark.skipif(not BOARDS, reason=f"no real measurements of boards in {DATA}")
fabrics = pytest.mark.skipif(not FABRICS, reason=f"no real measurements of fabrics in {DATA}")


def recorded(path: Path):
    """What the name says, times in s, 16 channels, and the position from the stated speed."""
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    about = NAME.match(path.stem).groupdict()
    return about, table[:, 3:], travelled(table[:, 0] / 1e3, float(about["speed"]))


@boards
@pytest.mark.parametrize("path", BOARDS, ids=lambda path: path.stem)
def test_with_speed_and_range_every_board_is_right(path):
    about, channels, position = recorded(path)
    ridge = about["ridge"]
    found = find_lines(position, channels, wavelength_range_mm=RANGES_MM[ridge])
    assert found.lines[0].wavelength_mm == pytest.approx(TRUTH_MM[ridge], rel=TOLERANCE[ridge])
    assert found.lines[0].chance < 1e-3
    assert found.unused_channels == found.unused_samples == 0


@boards
@pytest.mark.parametrize("path", BOARDS, ids=lambda path: path.stem)
@pytest.mark.parametrize("wavelengths", [(1.0, 8.0), (0.4, 6.0), (1.0, 40.0)])
def test_online_a_harmonic_is_hardly_ever_ok(path, wavelengths):
    """Slow, drifting, beside a stronger 20 mm component: little is answered, a harmonic in 5 % of the rows at most."""
    about, channels, _ = recorded(path)
    time = np.loadtxt(path, delimiter=",", skiprows=1, usecols=0) / 1e3
    rate = (len(time) - 1) / (time[-1] - time[0])
    pipeline = Pipeline(gauges=16, columns=("velocity_mm_s",), sample_rate_Hz=rate, wavelength_range_mm=wavelengths)
    found = pipeline.process(np.column_stack([time, channels, np.full(len(time), float(about["speed"]))]))
    told = found.wavelength_mm[[sentence.startswith("ok") for sentence in found.wavelength_status]]
    wrong = np.abs(told / TRUTH_MM[about["ridge"]] - 1) > 0.03
    assert wrong.sum() <= 0.05 * len(time)
