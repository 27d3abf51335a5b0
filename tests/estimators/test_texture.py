"""Textures over the path: speed and common modes do not matter, another texture is unknown; the model file."""

import json

import numpy as np
import pytest

from papilla.core.errors import FileAccessError, FileFormatError, InputError
from papilla.core.sealed import CHECKSUM_KEY, write_sealed
from papilla.estimators.texture import UNKNOWN_TEXTURE, Features, TextureModel, train

pytest.importorskip("sklearn", reason="scikit-learn (extra `texture`) is not installed")
HOW = Features(window_mm=30.0, shortest_mm=0.8, longest_mm=10.0, bands=6)
GAUGES_MM = np.array([0.0, 2.0, 5.0])
KINDS = {"fine": 1.2, "middle": 2.5, "coarse": 5.0}


def run(wavelength, speed, seed, hum=0.0, seconds=6.0):
    """Position (n,) and readings (n, 3) of a line with some roughness of its own, at 1 kHz."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(1000 * seconds)) / 1000
    place = speed * time
    profile = sum(
        size * np.sin(2 * np.pi * (place[:, None] - GAUGES_MM) / own + rng.uniform(0, 6.28))
        for own, size in ((wavelength, 1.0), (wavelength / 1.7, 0.3), (9.0, 0.4))
    )
    common = hum * np.sin(2 * np.pi * 50 * time + rng.uniform(0, 6.28))
    return place, 50 * profile + common[:, None] + rng.normal(0, 2, profile.shape)


def runs(speeds, seed=0, **options):
    return [
        (name, f"{speed}", *run(wavelength, float(speed), seed + 10 * number + count, **options))
        for number, (name, wavelength) in enumerate(KINDS.items())
        for count, speed in enumerate(speeds)
    ]


@pytest.fixture(scope="module")
def model():
    return train(runs((30.0, 60.0)), features=HOW)


def test_a_speed_that_was_never_trained_on_is_classified(model):
    assert model.accuracy["linear discriminant"] > 0.95 and model.labels == ("coarse", "fine", "middle")
    for name, wavelength in KINDS.items():
        labels, distances = model.classify(*run(wavelength, 95.0, 77))
        assert labels.count(name) >= 0.9 * len(labels) and distances.shape == (len(labels), 3)


def test_a_texture_like_none_is_unknown(model):
    labels, distances = model.classify(*run(0.9, 60.0, 9))
    assert labels.count(UNKNOWN_TEXTURE) >= 0.9 * len(labels)
    assert distances.min() > model.limit
    seen = np.concatenate([model.classify(*run[2:])[1].min(axis=1) for run in runs((30.0, 60.0))])
    assert model.limit > 1.1 * np.quantile(seen, 0.98), "known by runs of another speed, and a tenth more"
    rng = np.random.default_rng(0)
    place = 60 * np.arange(6000) / 1000
    assert set(model.classify(place, rng.normal(0, 50, (6000, 3)))[0]) == {UNKNOWN_TEXTURE}


def test_a_saved_model_answers_alike_and_a_changed_one_is_refused(model, tmp_path):
    path = tmp_path / "model.json"
    model.save(path)
    place, readings = run(1.2, 50.0, 3)
    again = TextureModel.load(path)
    np.testing.assert_array_equal(again.classify(place, readings)[1], model.classify(place, readings)[1])
    document = json.loads(path.read_text())
    path.write_text(json.dumps(document | {"limit": 1.0}))
    with pytest.raises(FileFormatError, match=r"model\.json: the file was changed after papilla wrote it"):
        TextureModel.load(path)
    path.write_text(json.dumps({"schema": "other"}))
    with pytest.raises(FileFormatError, match="the schema is 'other', this version of papilla reads 'papilla.t"):
        TextureModel.load(path)
    for text in ("{", "[" * 100000):
        path.write_text(text)
        with pytest.raises(FileFormatError, match="is not a texture model, or was cut short"):
            TextureModel.load(path)
    with pytest.raises(FileAccessError, match="cannot read texture model"):
        TextureModel.load(tmp_path / "none.json")


def test_what_cannot_be_trained_or_classified_is_refused(model):
    good = runs((30.0, 60.0))
    for bad, message in (
        ([], "there are no runs"),
        (good[:2], "two labels at least"),
        ([(name, "same", *rest) for name, _, *rest in good], "needs two groups at least"),
        ([*good, ("fine", "1", good[0][2], good[0][3][:, :2])], "the same number of channels"),
        ([("unknown", *rest) for _, *rest in good], "none of them 'unknown'"),
    ):
        with pytest.raises(InputError, match=message):
            train(bad, features=HOW)
    place, readings = run(1.2, 50.0, 3)
    with pytest.raises(InputError, match="the model is of 3 channels"):
        model.classify(place, readings[:, :2])
    with pytest.raises(InputError, match="no stroke of 30 mm"):
        model.classify(place[:100], readings[:100])
    with pytest.raises(InputError, match="samples are 0.5 mm apart"):
        model.classify(place[::10], readings[::10])
    with pytest.raises(InputError, match="wavelengths must rise, the longest at most half of the window"):
        Features(window_mm=30.0, longest_mm=20.0)


def test_a_gap_is_not_bridged_and_what_no_sensor_gives_is_left_out():
    """360 mm in windows of 30 mm; after 75 mm the finger is lifted over 7 mm, and a new window begins behind them."""
    place, readings = run(2.5, 60.0, 5)
    whole = HOW.of(place, readings)
    lifted = place + np.where(place > 75.0, 7.0, 0.0)
    parted = HOW.of(lifted, readings)
    behind = HOW.of(place[place > 75.0], readings[place > 75.0])
    np.testing.assert_allclose(parted, np.concatenate([whole[:2], behind]), rtol=1e-9)
    spoilt, wild = readings.copy(), place.copy()
    spoilt[5000, 1], wild[5500] = 1e300, -1e15
    np.testing.assert_array_equal(HOW.of(wild, spoilt)[:9], whole[:9])


@pytest.mark.parametrize("wavelength", [0.95, 2.0, 8.5])
@pytest.mark.parametrize("channels", [1, 2, 3])
def test_a_line_is_in_the_band_of_its_wavelength_with_its_power(wavelength, channels):
    """Six bands of 0.8-10 mm. Its power there rises with the square of the amplitude, shared by a band's width."""
    place = np.arange(0, 30.0 + 1e-9, 0.02)
    line = np.sin(2 * np.pi * place / wavelength)[:, None] * np.array([1.0, -1.0, 2.0])[:channels]
    found = HOW.of(place, line)
    assert found.shape == (1, 6 * channels), "a stroke of one window is one"
    edges = np.geomspace(1 / 10.0, 1 / 0.8, 7)
    band = int(np.searchsorted(edges, 1 / wavelength)) - 1
    by_channel = found.reshape(channels, 6)
    assert (by_channel.argmax(axis=1) == band).all()
    np.testing.assert_allclose(HOW.of(place, 3 * line) - found, np.log(9), rtol=1e-6)
    # Of three, the mean of all is taken away: 1, -1, 2 become 1/3, -5/3, 4/3.
    sizes = {1: [1.0], 2: [1.0, 1.0], 3: [1 / 3, 5 / 3, 4 / 3]}[channels]
    np.testing.assert_allclose(np.diff(by_channel[:, band]), np.diff(2 * np.log(sizes)), atol=1e-9)


@pytest.mark.parametrize("length, windows", [(29.5, 0), (30.4, 1), (59.5, 1), (60.4, 2), (150.4, 5)])
def test_a_run_is_cut_into_whole_windows(length, windows):
    place = np.arange(0, length, 0.1)
    readings = np.random.default_rng(0).normal(size=(len(place), 2))
    if not windows:
        with pytest.raises(InputError, match="the run has no stroke of 30 mm"):
            HOW.of(place, readings)
        return
    found = HOW.of(place, readings)
    assert found.shape == (windows, 12)
    back = HOW.of(np.concatenate([place, place[::-1]]), np.concatenate([readings, readings[::-1]]))
    assert back.shape == (2 * windows, 12)


@pytest.mark.parametrize(
    "changes",
    [
        {"centre": "many"}, {"means": [[1.0]]}, {"precision": [[10**400]]}, {"scale": {}},
        {"labels": [1, 2]}, {"labels": []}, {"features": {"window_mm": "long"}}, {"features": 3},
        {"channels": None}, {"channels": 7}, {"limit": -1.0}, {"limit": None}, {"channels": 2.5}, {"labels": "ab"},
        {"features": {"bands": 6.5}}, {"scale": [0.0] * 18}, {"centre": [1e300] * 18}, {"accuracy": 3},
    ],
)  # fmt: skip
def test_a_resealed_model_of_wrong_content_is_one_line(model, changes, tmp_path):
    path = tmp_path / "model.json"
    model.save(path)
    document = {name: value for name, value in json.loads(path.read_text()).items() if name != CHECKSUM_KEY}
    write_sealed(document | changes, path)
    with pytest.raises(FileFormatError, match=r"model\.json is (no|not a) texture model"):
        TextureModel.load(path)
