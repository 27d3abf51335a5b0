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
from papilla.estimators.texture import Features, train
from papilla.estimators.wavelength.lines import find_lines, travelled
from papilla_papers.methods.texture import log_band_features

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
def test_without_a_range_the_board_is_among_the_lines_strongest_first(path):
    about, channels, position = recorded(path)
    ridge = about["ridge"]
    lines = find_lines(position, channels).lines
    assert any(abs(line.wavelength_mm / TRUTH_MM[ridge] - 1) < TOLERANCE[ridge] for line in lines)
    assert any(abs(line.wavelength_mm / 20 - 1) < 0.03 for line in lines), "the 20 mm component is on every board"
    sizes = [line.amplitude for line in lines]
    assert sizes == sorted(sizes, reverse=True)


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


@fabrics
def test_fabrics_are_told_apart_on_a_repetition_that_was_not_trained_on():
    model_selection = pytest.importorskip("sklearn.model_selection", reason="scikit-learn is not installed")
    from sklearn.neighbors import KNeighborsClassifier
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    nearest, runs = make_pipeline(StandardScaler(), KNeighborsClassifier(3)), {}
    for path in FABRICS:
        about, channels, _ = recorded(path)
        times = np.loadtxt(path, delimiter=",", skiprows=1, usecols=0) / 1e3
        rate = (len(times) - 1) / (times[-1] - times[0])
        features = [
            log_band_features(window, rate, 4) for window in np.split(channels, range(96, len(channels), 96))[:-1]
        ]
        runs.setdefault((about["press"], about["speed"]), []).append((about, features))
    assert len(runs) >= 3
    for condition in runs.values():
        features = np.concatenate([own for _, own in condition])
        labels = np.concatenate([[about["what"]] * len(own) for about, own in condition])
        repetitions = np.concatenate([[about["repetition"]] * len(own) for about, own in condition])
        each = model_selection.LeaveOneGroupOut()
        right = model_selection.cross_val_score(nearest, features, labels, groups=repetitions, cv=each)
        assert len(set(labels)) == 7
        assert right.mean() > 0.7 and right.min() > 0.6, "chance is 0.14"


@fabrics
def test_fabrics_are_told_apart_at_a_speed_that_was_not_trained_on():
    """Over the path; bands in Hz get half of them right."""
    pytest.importorskip("sklearn", reason="scikit-learn (extra `texture`) is not installed")
    runs = []
    for path in FABRICS:
        about, channels, position = recorded(path)
        if about["press"] == "120":
            runs.append((about["what"], about["speed"], position, channels))
    model = train(runs, features=Features(window_mm=100.0, shortest_mm=3.0, longest_mm=50.0, bands=8))
    assert len(model.labels) == 7 and model.accuracy["linear discriminant"] > 0.9
