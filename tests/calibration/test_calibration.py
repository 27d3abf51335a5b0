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
from papilla.calibration.document import CALIBRATION_SCHEMA, to_document
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
        (20000.0, math.nan, SoftnessStatus.BAD_INPUT, (math.nan, math.nan)),
        (20000.0, -0.1, SoftnessStatus.BAD_INPUT, (math.nan, math.nan)),
        (math.inf, 0.5, SoftnessStatus.BAD_INPUT, (math.nan, math.nan)),
    ],
)
def test_never_a_modulus_outside_the_domain(sd, force, status, interval):
    answer = record().invert(sd, force)
    assert answer.status is status
    assert math.isnan(answer.modulus_MPa) and math.isnan(answer.sigma_MPa)
    assert answer.interval == pytest.approx(interval, nan_ok=True)


def test_just_beyond_the_hardest_the_interval_has_one_end():
    calibration = record(fit_rms=0.01)
    answer = calibration.invert(1.002 * calibration.predict(0.5, MODULUS[1]), 0.5)
    assert answer.status is SoftnessStatus.HARDER
    assert 0.02 < answer.lower_MPa < 5 and answer.upper_MPa == math.inf


def test_just_beyond_the_softest_the_interval_begins_at_zero():
    calibration = record(fit_rms=0.01)
    answer = calibration.invert(0.998 * calibration.predict(0.5, MODULUS[0]), 0.5)
    assert answer.status is SoftnessStatus.SOFTER
    # Beyond an end the slope by force of that end stands for the unknown one: its noise widens the interval
    noisy = calibration.invert(0.998 * calibration.predict(0.5, MODULUS[0]), 0.5, force_sigma=0.02)
    slope = calibration.surface.surface.slopes(0.5, MODULUS[0])[0]
    half = math.hypot(1.96 * 0.01, 1.96 * slope * 0.02 / 0.5)
    reached = 0.998 * calibration.predict(0.5, MODULUS[0]) * math.exp(half)
    assert answer.lower_MPa == noisy.lower_MPa == 0.0 < MODULUS[0] < answer.upper_MPa < noisy.upper_MPa
    assert calibration.predict(0.5, noisy.upper_MPa) == pytest.approx(reached, rel=1e-3)


def test_sigma_is_that_of_the_inputs_over_the_slope():
    calibration, force, modulus = record(fit_rms=0.0), 0.5, 0.5
    sd = calibration.predict(force, modulus)
    step = 1e-5
    slope = np.log(calibration.predict(force, modulus * (1 + step)) / sd) / step
    by_force = np.log(calibration.predict(force * (1 + step), modulus) / sd) / step
    assert calibration.invert(sd, force, sd_sigma=0.01 * sd).sigma_MPa == pytest.approx(
        modulus * 0.01 / slope, rel=1e-3
    )
    expected = modulus * by_force * 0.01 / slope
    assert calibration.invert(sd, force, force_sigma=0.01 * force).sigma_MPa == pytest.approx(expected, rel=1e-3)
    of_mesh = record(0.0, scatter=0.01).invert(sd, force).sigma_MPa
    assert of_mesh == pytest.approx(modulus * 0.01 * 2.04 / 1.96 / slope, rel=1e-3)
    assert record(0.01).invert(sd, force).sigma_MPa == pytest.approx(modulus * 0.01 / slope, rel=1e-3)
    with pytest.raises(InputError, match="must not be negative"):
        calibration.invert(sd, force, sd_sigma=-1.0)


def with_friction(calibration, shift=0.03):
    """The same calibration with S_d larger by exp(shift), and readings by 500 microstrain / N, without friction."""

    def doubted(readout, change):
        friction = BicubicSurface(FORCE, MODULUS, np.full((4, 4), change))
        return replace(readout, uncertainty=replace(readout.uncertainty, strain=1e-3, friction=friction))

    gauges = tuple(doubted(gauge, 500.0) for gauge in calibration.gauges)
    return replace(calibration, surface=doubted(calibration.surface, shift), gauges=gauges)


@pytest.mark.parametrize("shift", [0.03, -0.02, 0.002])
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
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
    document = json.loads((tmp_path / "c.json").read_text())
    for part in (document["softness"]["surface"], *document["softness"]["gauges"]):
        del part["uncertainty"]["friction"], part["uncertainty"]["strain"]
    (tmp_path / "older.json").write_text(json.dumps(document))
    with pytest.warns(UserWarning, match="checksum does not match"):
        older = Calibration.load(tmp_path / "older.json")
    assert older.surface.uncertainty.friction is None and older.dominant == "fit"


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
    part = Calibration(
        whole.finger, whole.mesh, whole.forward, whole.inverse,
        SdSurface(whole.surface.surface, usable, twofold, whole.surface.uncertainty), whole.gauges, {},
    )  # fmt: skip
    assert part.invert(whole.predict(0.5, 0.5 * edge), 0.5).status is SoftnessStatus.OK
    doubled = part.invert(whole.predict(0.5, 0.9 * edge), 0.5)
    assert doubled.status is SoftnessStatus.NOT_IDENTIFIABLE and math.isnan(doubled.modulus_MPa)


def test_the_file_has_the_documented_keys(tmp_path):
    record().save(tmp_path / "c.json")
    document = json.loads((tmp_path / "c.json").read_text())
    assert document["schema"] == CALIBRATION_SCHEMA == "papilla.calibration/1"
    forward, inverse = document["softness"]["forward"], document["softness"]["inverse"]
    assert forward["form"] == "quadratic" and forward["terms"] == ["f2", "f", "E2", "E", "1"]
    assert forward["units"] == {"f": "gf", "E": "MPa", "sd": "microstrain"}
    assert {"coefficients", "stderr", "covariance", "rms", "max"} <= set(forward)
    assert inverse["terms"] == ["sd", "f2", "f", "1"]
    assert {"coefficients", "shift", "branch", "modulus_MPa"} <= set(inverse)
    assert {"surface", "gauges"} <= set(document["softness"])
    assert set(document["domain"]) == {"force_N", "modulus_MPa"}
    assert {"name", "sha256"} <= set(document["finger"]) and "provenance" in document and "mesh" in document


NO_COVARIANCE = (np.eye(5) + 2 * (np.eye(5, k=1) + np.eye(5, k=-1))).tolist()
"""Symmetric, and positive on its diagonal, but with correlations of 2."""


def drop(document, *keys):
    inner = document
    for key in keys[:-1]:
        inner = inner[key]
    del inner[keys[-1]]


def put(document, value, *keys):
    inner = document
    for key in keys[:-1]:
        inner = inner[key]
    inner[keys[-1]] = value


OF_SD = ("softness", "surface", "uncertainty")


@pytest.mark.parametrize(
    "spoil, message",
    [
        (lambda d: put(d, "papilla.calibration/2", "schema"), "schema is 'papilla.calibration/2', this version"),
        (lambda d: drop(d, "schema"), "schema is None"),
        (lambda d: drop(d, "softness", "inverse", "shift"), "key softness.inverse.shift is missing"),
        (
            lambda d: put(d, "high", "softness", "forward", "rms"),
            "softness.forward.rms must be a valid number, got 'high'",
        ),
        (lambda d: put(d, math.nan, "softness", "forward", "rms"), "not valid JSON .NaN is no number"),
        (lambda d: put(d, True, "softness", "forward", "max"), "must be a valid number, got True"),
        (lambda d: put(d, 10**400, "softness", "forward", "max"), "not valid JSON .10{39}.* is too long for a number"),
        (lambda d: put(d, 10**399, "softness", "forward", "max"), "must be a"),
        (lambda d: put(d, [1, 2], "softness", "inverse", "coefficients"), "coefficients must be a list of 4 finite"),
        (lambda d: put(d, ["E"], "softness", "forward", "terms"), "softness.forward.terms must be"),
        (lambda d: put(d, 0, "softness", "inverse", "branch"), "softness.inverse.branch must be -1 or 1, got 0"),
        (lambda d: put(d, [1, 0.1], "softness", "surface", "force_N"), "force_N must be a rising range"),
        (lambda d: put(d, [5, 12], "softness", "surface", "cells"), "coefficients must be a list of 8 x 15"),
        (lambda d: put(d, [[0, 99]] * 6, "softness", "surface", "usable_nodes"), "whole numbers from 0 to 12"),
        (
            lambda d: put(d, None, "softness", "surface", "coefficients", 0, 0),
            "surface.coefficients must be a list of n",
        ),
        (lambda d: put(d, [[1], [2, 3]], "softness", "surface", "coefficients"), "coefficients must be a list"),
        (
            lambda d: put(d, [2, 1], "softness", "gauges", 0, "uncertainty", "scatter_force_N"),
            "gauges\\[0\\].* must rise",
        ),
        (
            lambda d: put(d, [0, 0, 0], *OF_SD, "scatter") or put(d, [0.1, 0.3, 0.2], *OF_SD, "scatter_force_N"),
            "scatter_force_N.* must rise",
        ),
        (lambda d: put(d, {}, "softness", "gauges"), "softness.gauges must be a valid list"),
        (lambda d: put(d, [0.05, 2.0], "domain", "force_N"), "domain differs"),
        (lambda d: put(d, -1e-4, *OF_SD, "fit_rms"), "fit_rms must be greater than or eq"),
        (lambda d: put(d, [-0.1, 0.1], *OF_SD, "scatter"), "scatter must not be negative"),
        (lambda d: put(d, -1, *OF_SD, "scatter_factor"), "scatter_factor must be great"),
        (lambda d: put(d, 0.9, *OF_SD, "level"), "level must be 0.95, got 0.9"),
        (lambda d: put(d, "sd_microstrain", "softness", "surface", "quantity"), "quantity must be 'ln\\(sd_micr"),
        (lambda d: put(d, "reading", "softness", "gauges", 1, "quantity"), r"\[1\].quantity must be 'reading_mic"),
        (lambda d: put(d, "B-spline", "softness", "gauges", 0, "form"), r"gauges\[0\].form must be 'uniform bicubic"),
        (lambda d: put(d, [-1, 1, 1, 1, 1], "softness", "forward", "stderr"), "stderr must not be negative"),
        (lambda d: put(d, {"f": "N"}, "softness", "forward", "units"), "softness.forward.units must be {'f': 'gf'"),
        (lambda d: put(d, 3, "finger"), "finger must be a valid dictionary, got 3"),
        (lambda d: put(d, [1], "notes"), r"notes\[0\] must be a valid string, got 1"),
        (lambda d: put(d, [], "softness", "gauges"), "softness: gauges must hold 1 to 1000 of them, got 0"),
        (lambda d: put(d, "\ud800", "finger", "name"), "not valid JSON"),
        (lambda d: put(d, ["x" * 3000], "notes"), r"notes\[0\]: String should have at most 2000"),
        (lambda d: put(d, "x" * 300, "finger", "name"), "finger: name must be a text of 1 to 200 letters, got 300"),
        (lambda d: put(d, ["x"], "finger", "name"), "finger: name must be a text"),
        (lambda d: put(d, "g\n1", "softness", "gauges", 0, "name"), "name of a gauge has '.n' in it"),
        (lambda d: put(d, -1.0, "softness", "forward", "covariance", 0, 0), "covariance must be symmetric and pos"),
        (lambda d: put(d, 1e3, "softness", "forward", "covariance", 0, 1), "covariance must be symmetric and pos"),
        (lambda d: put(d, NO_COVARIANCE, "softness", "forward", "covariance"), "covariance must be symmetric and pos"),
    ],
)
def test_a_broken_file_is_refused_with_file_and_key(tmp_path, spoil, message):
    path = tmp_path / "c.json"
    document = to_document(record())
    spoil(document)
    path.write_text(json.dumps(document))
    with pytest.raises(FileFormatError, match=message) as caught:
        Calibration.load(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def changed(path, *keys, by=1e-9):
    """The same file with one number changed by that fraction."""
    document = json.loads(path.read_text())
    inner = document
    for key in keys[:-1]:
        inner = inner[key]
    inner[keys[-1]] *= 1 + by
    path.write_text(json.dumps(document))


@pytest.mark.parametrize(
    "keys",
    [
        ("softness", "surface", "coefficients", 3, 4),
        ("softness", "gauges", 0, "coefficients", 0, 0),
        (*OF_SD, "fit_rms"),
        ("softness", "forward", "coefficients", 0),
    ],
)
def test_a_file_that_was_changed_loads_with_a_remark(tmp_path, keys):
    path = tmp_path / "c.json"
    record().save(path)
    changed(path, *keys)
    with pytest.warns(UserWarning, match=r"c.json: the file was changed after papilla wrote it: its checksum"):
        loaded = Calibration.load(path)
    assert loaded.remark.startswith("the file was changed after papilla wrote it")
    loaded.save(path)
    assert Calibration.load(path).notes == (*loaded.notes, loaded.remark), "saved again, it still says so"


def test_a_file_without_checksum_loads_with_a_remark(tmp_path):
    """Files of older versions have none."""
    path = tmp_path / "c.json"
    path.write_text(json.dumps(to_document(record())))
    with pytest.warns(UserWarning, match="the file has no checksum, so papilla cannot say whether it was edited"):
        assert Calibration.load(path).notes == record().notes


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
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FileFormatError, match="c.json is not a text file in UTF-8"):
        Calibration.load(path)
    path.write_text("[1, 2]")
    with pytest.raises(FileFormatError, match="the schema is None"):
        Calibration.load(path)
    with pytest.raises(FileAccessError, match="cannot read calibration"):
        Calibration.load(tmp_path / "absent.json")


def test_a_file_is_written_whole_or_not_at_all(tmp_path):
    with pytest.raises(FileAccessError, match="cannot write"):
        record().save(tmp_path / "no such folder" / "c.json")
    assert list(tmp_path.iterdir()) == []


# ---- Contact positions, the optional part


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
    assert np.isfinite(one.position.change(0.3, 0.3, [-4.0, 4.0])).all()
    assert np.isnan(one.position.change(0.3, 0.3, [-4.001, 4.001, np.nan])).all()
    assert np.isnan(one.position.change([0.049, 0.3], [0.3, 5.1], 0.0)).all()


@pytest.mark.parametrize(
    "spoil, message",
    [
        (lambda p: p.pop("error"), "key softness.position.error is missing"),
        (lambda p: p.update(form="cubic"), "softness.position.form must be"),
        (lambda p: p.update(cells=[2, 3, 7]), "softness.position: coefficients must be a list of 2 x 5 x 6 x 10"),
        (lambda p: p.update(reach_mm=0.0), "reach of contact positions .* greater than 0, got 0"),
        (lambda p: p["error"][0].__setitem__(0, -1.0), "contact positions need 2 x 9 errors of at least 0"),
        (lambda p: p.update(gauges=1, coefficients=p["coefficients"][:1], error=p["error"][:1]), "must hold 2 gauges"),
    ],
)
def test_broken_positions_are_refused(tmp_path, spoil, message):
    document = to_document(beside())
    spoil(document["softness"]["position"])
    path = tmp_path / "c.json"
    path.write_text(json.dumps(document))
    with pytest.raises(FileFormatError, match=message):
        Calibration.load(path)
