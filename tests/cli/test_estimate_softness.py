"""`papilla estimate --softness`: the published form beside the calibrated surfaces."""

import json
from dataclasses import replace

import numpy as np
import pytest
from made_up_sweep import make_sweep

from papilla.calibration import fit
from papilla.core.errors import InputError
from papilla.core.tables import write_table
from papilla_papers.methods.force_depth import DepthErrors, ForceDepth


@pytest.fixture
def log(tmp_path):
    time = np.arange(200) / 1000
    rows = np.column_stack([time, np.outer(np.ones(200), [-900.0, 0.0, 2500.0, 10.0, -800.0]), np.full(200, 0.4)])
    rows[:, 1:6] += np.random.default_rng(0).normal(0, 2, (200, 5))
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="t_s,g1,g2,g3,g4,g5,force_N", comments="")
    return tmp_path / "log.csv"


def test_thickness_is_refused_for_a_published_form(refused, log):
    said = refused("estimate", log, "--out", "out.csv", "--softness", "printed", "--thickness", 5)
    assert "--thickness" in said


@pytest.fixture(scope="module")
def touch(tmp_path_factory):
    """A calibration's folder with its sweep, and the log of a touch of 0.3 MPa, by laws of their own."""
    folder = tmp_path_factory.mktemp("touch")
    forces, moduli = np.geomspace(0.05, 1.0, 12), np.geomspace(0.05, 1.0, 20)
    pattern = np.array([-0.4, -0.8, 1.5, -0.8, -0.4])

    def readings(force, modulus):
        return np.multiply.outer(2000 * np.asarray(force) ** 0.7 * modulus**0.15, pattern)

    def depth(force, modulus):
        return np.asarray(force) ** 0.6 * (0.5 + 0.2 * modulus**-0.5)

    table = make_sweep(forces, moduli)
    rows = readings(table.force_N, table.modulus_MPa)
    table = replace(table, reading=rows, sd_microstrain=rows.std(axis=1))
    fit(table).save(folder / "calibration.json")
    gauges = {f"g{number + 1}": column for number, column in enumerate(rows.T)}
    known = {"force_N": table.force_N, "modulus_MPa": table.modulus_MPa, **gauges}
    write_table(folder / "sweep.csv", known | {"indentation_mm": depth(table.force_N, table.modulus_MPa)})
    time = np.arange(900) / 1000
    force = np.interp(time, [0, 0.2, 0.6, 0.9], [0, 0, 0.6, 0.6])
    rng = np.random.default_rng(4)
    felt = readings(force, 0.3) + rng.normal(0, 2, (900, 5))
    columns = {"t_s": time, **{f"g{number + 1}": own for number, own in enumerate(felt.T)}, "force_N": force}
    write_table(folder / "log.csv", columns | {"indentation_mm": depth(force, 0.3) + rng.normal(0, 1e-3, 900)})
    return folder


@pytest.mark.parametrize("softness", ["gauges", "surface", "sd", "force-depth"])
def test_the_modulus_of_a_touch_comes_from_gauges_from_s_d_or_from_force_and_depth(papilla, touch, tmp_path, softness):
    calibration = touch / "calibration.json"
    options = ("--calibration", calibration, "--softness", softness, "--out", "est.csv", "--json")
    done = papilla("estimate", touch / "log.csv", *options)
    assert done.code == 0, done.err
    found = json.loads(done.out)
    last = found["last_answer"]
    assert abs(last["modulus_MPa"] - 0.3) < 2 * last["modulus_sigma_MPa"] < 0.3
    assert found["ok_rows"]["modulus"] > 450 and "" not in found["legend"]["modulus"]
    assert found["statuses"]["modulus"]["no contact"] >= 195
    written = (tmp_path / "est.csv").read_text().splitlines()[-1].split(",")
    assert float(written[1]) == pytest.approx(0.3, rel=0.4) and written[10] == "ok"


def test_force_and_depth_need_their_columns_and_the_sweep(refused, touch, log):
    calibration = touch / "calibration.json"
    how = ("--softness", "force-depth", "--out", "out.csv")
    assert "column indentation_mm is missing" in refused("estimate", log, "--calibration", calibration, *how)
    assert "needs --calibration with its sweep.csv" in refused("estimate", touch / "log.csv", *how)


def test_force_depth_says_where_it_has_no_answer():
    forces, moduli = np.geomspace(0.05, 1.0, 12), np.geomspace(0.05, 1.0, 20)
    force, modulus = (each.ravel() for each in np.meshgrid(forces, moduli))
    model = ForceDepth(force, modulus, force**0.6 * (0.5 + 0.2 * modulus**-0.5))
    inside = np.random.default_rng(1).uniform(0.06, 0.9, (2, 300))
    depth = inside[0] ** 0.6 * (0.5 + 0.2 * inside[1] ** -0.5)
    found, sigma, status = model.process(inside[0], depth, DepthErrors())
    np.testing.assert_allclose(found, inside[1], rtol=2e-3)
    step = 1e-4 * depth
    moved, _, _ = model.process(inside[0], depth + step, DepthErrors())
    alone = model.process(inside[0], depth, DepthErrors(depth_mm=0.01, force_N=0, contact_mm=0, model=0))[1]
    np.testing.assert_allclose(alone, np.abs(moved - found) / step * 0.01, rtol=0.05)
    cases = {"BAD_INPUT": (0.5, np.nan), "NO_CONTACT": (0.0, 0.0), "FORCE_BELOW": (0.04, 0.2)}
    cases |= {"FORCE_ABOVE": (2.0, 1.0), "HARDER": (0.5, 0.3), "SOFTER": (0.5, 3.0)}
    force, depth = np.array(list(cases.values())).T
    modulus, sigma, status = model.process(force, depth, DepthErrors())
    assert [one.name for one in status] == [*cases] and np.isnan(modulus).all() and np.isnan(sigma).all()
    ends = forces[[0, -1]]
    modulus, _, _ = model.process(ends, ends**0.6 * (0.5 + 0.2 * 0.3**-0.5), DepthErrors())
    np.testing.assert_allclose(modulus, 0.3, rtol=2e-3, err_msg="the sweep's own least and largest force")
    with pytest.raises(InputError, match="the sweep must hold the depth"):
        ForceDepth(force, force, force)


def test_without_a_calibration_there_is_no_modulus_either_way(papilla, log):
    done = papilla("estimate", log, "--out", "out.csv", "--softness", "quadratic", "--json")
    assert done.code == 0 and json.loads(done.out)["answered_rows"]["modulus_MPa"] == 0
