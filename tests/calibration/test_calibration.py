"""The calibration record: forward and inverse, intervals, files."""

import json
import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from papilla.calibration import (
    Calibration,
    GaugeSurface,
    PositionTerms,
    Quadratic,
    SdSurface,
    SoftnessStatus,
    Uncertainty,
)
from papilla.calibration.document import to_document
from papilla.calibration.surface import BicubicSurface
from papilla.core.errors import FileAccessError, FileFormatError, InputError

FORCE, MODULUS = (0.05, 1.0), (0.02, 5.0)


def record(fit_rms=1e-4, scatter=0.0, fold=False) -> Calibration:
    """ln S_d = 9 + 0.6 ln f + 0.2 (y - 0.08 y^2 ...) with y = ln(E / 0.02): rising, ever flatter; it folds if asked."""
    m, n = 6, 12
    x = np.log(FORCE[0]) + (np.arange(m + 3) - 1) * np.log(FORCE[1] / FORCE[0]) / m
    y = (np.arange(n + 3) - 1) * np.log(MODULUS[1] / MODULUS[0]) / n
    rise = 0.2 * (y - y**2 / (5 if fold else 2) / (1 if fold else 8))
    surface = BicubicSurface(FORCE, MODULUS, 9 + 0.6 * x[:, None] + rise[None, :] + 0.01 * x[:, None] * y[None, :])
    known = Uncertainty(fit_rms, 1.96, 3 * fit_rms, np.array([0.1, 0.5]), np.full(2, scatter), 2.04, 4)
    usable, twofold = np.tile([0, n], (m, 1)), np.full((m, 2), np.nan)
    forward = Quadratic(
        np.array([-0.03, 14.0, 87.0, 104.0, -81.0]), np.array([0.1, 1, math.nan, 1, 1]),
        np.eye(5), 1.0, 2.0, (0.089, 0.72), 40.0, ("a doubt",),
    )  # fmt: skip
    gauge = GaugeSurface("g1", BicubicSurface(FORCE, MODULUS, -surface.coefficients), known)
    return Calibration(
        {"name": "f", "sha256": "ab"}, {"sha256": "cd"}, forward, forward.inverse,
        SdSurface(surface, usable, twofold, known), (gauge, gauge), {"created": "now"}, ("doubt this",),
    )  # fmt: skip


def domain_points(count, seed=0):
    rng = np.random.default_rng(seed)
    return np.exp(rng.uniform(*np.log(FORCE), count)), np.exp(rng.uniform(*np.log(MODULUS), count))


def test_scalars_and_arrays_agree():
    calibration, (force, modulus) = record(), domain_points(6)
    sd = calibration.predict(force, modulus).reshape(2, 3)
    many = calibration.invert(sd, force.reshape(2, 3), force_sigma=0.001)
    one = calibration.invert(float(sd[1, 2]), float(force[5]), force_sigma=0.001)
    assert many.modulus_MPa.shape == many.status.shape == (2, 3)
    assert (one.modulus_MPa, one.sigma_MPa, *one.interval) == tuple(
        values[1, 2] for values in (many.modulus_MPa, many.sigma_MPa, *many.interval)
    )
    assert one.status is SoftnessStatus.OK and one.sentence == "ok"
    assert many.sentence.shape == (2, 3) and set(many.sentence.ravel()) == {"ok"}
    assert calibration.invert(np.array([]), np.array([])).modulus_MPa.shape == (0,)


@pytest.mark.parametrize(
    "sd, force, status, interval",
    [
        (20000.0, 0.0499, SoftnessStatus.FORCE_BELOW, (math.nan, math.nan)),
        (20000.0, 1.0001, SoftnessStatus.FORCE_ABOVE, (math.nan, math.nan)),
        (10.0, 0.5, SoftnessStatus.SOFTER, (0.0, 0.0)),
        (1e9, 0.5, SoftnessStatus.HARDER, (math.inf, math.inf)),
        (math.nan, 0.5, SoftnessStatus.BAD_INPUT, (math.nan, math.nan)),
        (0.0, 0.5, SoftnessStatus.BAD_INPUT, (math.nan, math.nan)),
        (20000.0, -0.1, SoftnessStatus.BAD_INPUT, (math.nan, math.nan)),
    ],
)
def test_never_a_modulus_outside_the_domain(sd, force, status, interval):
    answer = record().invert(sd, force)
    assert answer.status is status
    assert math.isnan(answer.modulus_MPa) and math.isnan(answer.sigma_MPa)
    assert answer.interval == pytest.approx(interval, nan_ok=True)


def test_just_beyond_the_domain_the_interval_has_one_end():
    """Beyond an end the slope by force of that end stands for the unknown one: its noise widens the interval."""
    calibration = record(fit_rms=0.01)
    hard = calibration.invert(1.002 * calibration.predict(0.5, MODULUS[1]), 0.5)
    assert hard.status is SoftnessStatus.HARDER and 0.02 < hard.lower_MPa < 5 and hard.upper_MPa == math.inf
    sd = 0.998 * calibration.predict(0.5, MODULUS[0])
    soft, noisy = (calibration.invert(sd, 0.5, force_sigma=sigma) for sigma in (0.0, 0.02))
    assert soft.status is SoftnessStatus.SOFTER
    slope = calibration.surface.surface.slopes(0.5, MODULUS[0])[0]
    reached = sd * math.exp(math.hypot(1.96 * 0.01, 1.96 * slope * 0.02 / 0.5))
    assert soft.lower_MPa == noisy.lower_MPa == 0.0 < MODULUS[0] < soft.upper_MPa < noisy.upper_MPa
    assert calibration.predict(0.5, noisy.upper_MPa) == pytest.approx(reached, rel=1e-3)


def test_sigma_is_that_of_the_inputs_over_the_slope():
    calibration, force, modulus = record(fit_rms=0.0), 0.5, 0.5
    sd, step = calibration.predict(force, modulus), 1e-5
    slope = np.log(calibration.predict(force, modulus * (1 + step)) / sd) / step
    by_force = np.log(calibration.predict(force * (1 + step), modulus) / sd) / step
    for found, expected in (
        (calibration.invert(sd, force, sd_sigma=0.01 * sd), 1.0),
        (calibration.invert(sd, force, force_sigma=0.01 * force), by_force),
        (record(0.0, scatter=0.01).invert(sd, force), 2.04 / 1.96),
        (record(0.01).invert(sd, force), 1.0),
    ):
        assert found.sigma_MPa == pytest.approx(modulus * 0.01 * expected / slope, rel=1e-3)
    with pytest.raises(InputError, match="must not be negative"):
        calibration.invert(sd, force, sd_sigma=-1.0)


def with_friction(calibration, shift=0.03):
    """The same calibration with S_d larger by exp(shift), and readings by 500 microstrain / N, without friction."""

    def doubted(readout, change):
        friction = BicubicSurface(FORCE, MODULUS, np.full((4, 4), change))
        return replace(readout, uncertainty=replace(readout.uncertainty, strain=1e-3, friction=friction))

    gauges = tuple(doubted(gauge, 500.0) for gauge in calibration.gauges)
    return replace(calibration, surface=doubted(calibration.surface, shift), gauges=gauges)


@pytest.mark.parametrize("shift, share", [(0.03, 0.0), (-0.02, 0.5), (-0.02, 1.0), (0.002, 0.5)])
def test_friction_that_is_not_known_is_inside_the_interval(shift, share):
    """Noisy S_d of a press with some share of what no friction changes: ends are missed in 5 %, the middle less."""
    calibration, rng = with_friction(record(fit_rms=0.0), shift), np.random.default_rng(7)
    force, modulus, sigma = 0.4, 0.2, 0.005
    sd = calibration.predict(force, modulus) * np.exp(share * shift + sigma * rng.normal(size=2000))
    answer = calibration.invert(sd, force, sd_sigma=sigma * sd)
    inside = np.mean((answer.lower_MPa <= modulus) & (modulus <= answer.upper_MPa))
    assert (0.935 < inside < 0.98) if share != 0.5 else inside > 0.95
    assert set(answer.dominant) == {"friction" if abs(shift) > 0.01 else "measurement"}


def test_what_is_not_known_of_friction_is_in_the_file(tmp_path):
    calibration = with_friction(record())
    calibration.save(tmp_path / "c.json")
    again = Calibration.load(tmp_path / "c.json")
    for one, other in zip((calibration.surface, *calibration.gauges), (again.surface, *again.gauges), strict=True):
        assert other.uncertainty.strain == one.uncertainty.strain == 1e-3
        assert other.uncertainty.friction(0.3, 0.3) == one.uncertainty.friction(0.3, 0.3)


def test_hard_specimens_are_not_identifiable():
    """Where S_d hardly rises, 6 % of it is more than half of E: the estimate comes with a warning and an interval."""
    calibration = record(fit_rms=0.06)
    answer = calibration.invert(calibration.predict(0.5, 1.5), 0.5)
    assert answer.status is SoftnessStatus.NOT_IDENTIFIABLE and "not identifiable" in answer.sentence
    assert answer.sigma_MPa > 0.5 * answer.modulus_MPa
    assert answer.lower_MPa < 1.5 < answer.upper_MPa
    assert calibration.invert(calibration.predict(0.5, 0.03), 0.5).status is SoftnessStatus.OK


def test_double_values_are_not_identifiable():
    whole = record()
    usable = np.tile([0, 8], (6, 1))
    edge = whole.surface.surface.modulus_axis.nodes[8]
    twofold = np.tile(np.log([whole.predict(0.5, 0.8 * edge), whole.predict(0.5, 5.0)]), (6, 1))
    surface = SdSurface(whole.surface.surface, usable, twofold, whole.surface.uncertainty)
    part = replace(whole, surface=surface)
    assert part.invert(whole.predict(0.5, 0.5 * edge), 0.5).status is SoftnessStatus.OK
    doubled = part.invert(whole.predict(0.5, 0.9 * edge), 0.5)
    assert doubled.status is SoftnessStatus.NOT_IDENTIFIABLE and math.isnan(doubled.modulus_MPa)


def put(document, value, *keys):
    """Set a value inside a document, or delete it if the value is `...`."""
    for key in keys[:-1]:
        document = document[key]
    if value is ...:
        del document[keys[-1]]
    else:
        document[keys[-1]] = value


FORWARD, SURFACE, GAUGES = ("softness", "forward"), ("softness", "surface"), ("softness", "gauges")
OF_SD = (*SURFACE, "uncertainty")
BESIDE = ("softness", "position")


@pytest.mark.parametrize(
    "keys, value, message",
    [
        (("schema",), "papilla.calibration/2", "schema is 'papilla.calibration/2', this version"),
        (("softness", "inverse", "shift"), ..., "key softness.inverse.shift is missing"),
        ((*FORWARD, "rms"), "high", "softness.forward.rms must be a valid number, got 'high'"),
        ((*FORWARD, "rms"), math.nan, "not valid JSON .NaN is no number"),
        ((*FORWARD, "max"), 10**400, "not valid JSON .10{39}.* is too long for a number"),
        ((*FORWARD, "terms"), ["E"], "softness.forward.terms must be"),
        ((*FORWARD, "stderr"), [-1, 1, 1, 1, 1], "stderr must not be negative"),
        ((*FORWARD, "covariance", 0, 1), 1e3, "covariance must be symmetric and pos"),
        ((*FORWARD, "covariance"), (np.eye(5) + 2 * (np.eye(5, k=1) + np.eye(5, k=-1))).tolist(), "symmetric and pos"),
        (("softness", "inverse", "coefficients"), [1, 2], "coefficients must be a list of 4 finite"),
        (("softness", "inverse", "branch"), 0, "softness.inverse.branch must be -1 or 1, got 0"),
        ((*SURFACE, "force_N"), [1, 0.1], "force_N must be a rising range"),
        ((*SURFACE, "cells"), [5, 12], "coefficients must be a list of 8 x 15"),
        ((*SURFACE, "usable_nodes"), [[0, 99]] * 6, "whole numbers from 0 to 12"),
        ((*SURFACE, "coefficients", 0, 0), None, "surface.coefficients must be a list of n"),
        ((*SURFACE, "coefficients", 0, 0), 101.0, r"ln\(sd_microstrain\) must lie between -100 and 100"),
        (GAUGES, [], "softness: gauges must hold 1 to 1000 of them, got 0"),
        ((*GAUGES, 0, "uncertainty", "scatter_force_N"), [2, 1], r"gauges\[0\].* must rise"),
        ((*GAUGES, 0, "name"), "g\n1", "name of a gauge has '.n' in it"),
        ((*OF_SD, "fit_rms"), -1e-4, "fit_rms must be greater than or eq"),
        ((*OF_SD, "scatter"), [-0.1, 0.1], "scatter must not be negative"),
        ((*OF_SD, "level"), 0.9, "level must be 0.95, got 0.9"),
        (("domain", "force_N"), [0.05, 2.0], "domain differs"),
        (("finger",), 3, "finger must be a valid dictionary, got 3"),
        (("notes",), ["x" * 3000], r"notes\[0\]: String should have at most 2000"),
        ((*BESIDE, "cells"), [2, 3, 7], "softness.position: coefficients must be a list of 2 x 5 x 6 x 10"),
        ((*BESIDE, "error", 0, 0), -1.0, "contact positions need 2 x 9 errors of at least 0"),
    ],
)
def test_a_broken_file_is_refused_with_file_and_key(tmp_path, keys, value, message):
    path = tmp_path / "c.json"
    document = to_document(beside())
    put(document, value, *keys)
    path.write_text(json.dumps(document))
    with pytest.raises(FileFormatError, match=message) as caught:
        Calibration.load(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_a_file_that_was_changed_or_has_no_checksum_loads_with_a_remark(tmp_path):
    path = tmp_path / "c.json"
    record().save(path)
    document = json.loads(path.read_text())
    document["softness"]["gauges"][0]["coefficients"][0][0] *= 1 + 1e-9
    for written, remark in (
        (document, "the file was changed after papilla wrote it: its checksum"),
        (to_document(record()), "the file has no checksum, so papilla cannot say whether it was edited"),
    ):
        path.write_text(json.dumps(written))
        with pytest.warns(UserWarning, match=f"c.json: {remark}"):
            loaded = Calibration.load(path)
        assert loaded.notes == record().notes
    loaded.save(path)
    assert Calibration.load(path).notes == (*loaded.notes, loaded.file_note), "saved again, it still says so"


def test_estimators_do_without_the_library_of_files():
    imports = "import sys, papilla.calibration; from papilla.estimators import Pipeline"
    code = f"{imports}; print(bool({{'pydantic', 'papilla.logs'}} & {{*sys.modules}}))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "False"


def test_truncated_foreign_and_missing_files_are_refused(tmp_path):
    path = tmp_path / "c.json"
    record().save(path)
    whole = path.read_bytes()
    for length in (0, 1, 500, len(whole) // 2, len(whole) - 3):
        path.write_bytes(whole[:length])
        with pytest.raises(FileFormatError, match="cut short"):
            Calibration.load(path)
    for content, message in ((b"\xff\xfe", "c.json is not a text file in UTF-8"), (b"[1, 2]", "the schema is None")):
        path.write_bytes(content)
        with pytest.raises(FileFormatError, match=message):
            Calibration.load(path)
    with pytest.raises(FileAccessError, match="cannot read calibration"):
        Calibration.load(tmp_path / "absent.json")
    with pytest.raises(FileAccessError, match="cannot write"):
        record().save(tmp_path / "no such folder" / "c.json")
    assert [*tmp_path.iterdir()] == [path]


def beside(reach=4.0) -> Calibration:
    """The record with random changes of its two gauges, 2 x 3 x 8 cells."""
    coefficients = np.random.default_rng(3).normal(size=(2, 5, 6, 11))
    coefficients[..., 5] = -(coefficients[..., 4] + coefficients[..., 6]) / 4
    error = np.abs(np.linspace(-4, 4, 9))[None, :] * [[1.0], [2.0]]
    return replace(record(), position=PositionTerms(FORCE, MODULUS, reach, coefficients, error))


def test_changes_vanish_at_the_apex_and_end_at_the_reach():
    one, (force, modulus) = beside(), domain_points(50)
    apex = one.predict_readings(force, modulus)
    np.testing.assert_allclose(one.predict_readings(force, modulus, 0.0), apex, rtol=1e-13)
    moved = one.predict_readings(force, modulus, 2.5)
    np.testing.assert_allclose(moved - apex, force[:, None] * one.position.change(force, modulus, 2.5), atol=1e-9)
    assert np.isnan(one.position.change(0.3, 0.3, [-4.001, 4.001, np.nan])).all()
