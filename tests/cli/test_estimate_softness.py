"""`papilla estimate --softness`: the published form beside the calibrated surfaces."""

import json

import numpy as np
import pytest


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


def test_without_a_calibration_there_is_no_modulus_either_way(papilla, log):
    done = papilla("estimate", log, "--out", "out.csv", "--softness", "quadratic", "--json")
    assert done.code == 0 and json.loads(done.out)["answered_rows"]["modulus_MPa"] == 0
