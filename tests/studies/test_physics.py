"""The table of effects: what is known of each."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.errors import ContactRangeError
from papilla.finger import Finger
from papilla.studies.physics import FORCES_GF, MODULI_MPA, Bench, TiltedBlock, physics
from papilla.units import gf_to_newton


def test_a_modulus_is_read_from_the_presses_without_the_effect(monkeypatch):
    """S_d grows with ln E here: a specimen that presses 10 % harder is read so, and a refused press is none."""

    def sd(force, modulus):
        return 1000 * force * (10 + math.log(modulus))

    def stiffer(force, modulus):
        if force > gf_to_newton(50) and modulus > 0.2:
            raise ContactRangeError("too far")
        return sd(force, 1.1 * modulus)

    monkeypatch.setattr(Bench, "plain", lambda self, force, modulus: SimpleNamespace(sd=sd(force, modulus)))
    found = Bench(Finger.default()).effect("harder", "10 %", "nothing", stiffer)
    expected = np.array([[1 + math.log(1.1) / (10 + math.log(modulus)) for modulus in MODULI_MPA]] * 3)
    expected[2, 1] = math.nan
    assert found.sd_ratio == pytest.approx(expected, nan_ok=True)
    assert found.modulus_ratio == pytest.approx(np.where(np.isnan(expected), math.nan, 1.1), rel=1e-3, nan_ok=True)
    assert found.worst == pytest.approx(expected[0].max() - 1)
    shown = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert shown["sd_ratio"][2][1] is None and shown["effect"] == "harder" and shown["size"] == "10 %"


def test_a_tilted_block_rises_across_the_finger():
    points = np.array([[0.0, 3.0], [2.0, 0.0], [-2.0, 1.0]])
    assert TiltedBlock(0.5, 10.0, tilt_deg=45.0).gap(points) == pytest.approx([0, 2, -2])


@pytest.mark.slow
def test_the_table_says_what_is_known():
    said = []
    effects = {(one.name, one.size): one for one in physics(Finger.default(), 2.0, said.append)}
    assert len(said) == len(effects)
    assert [one.worst for one in effects.values()] == sorted((one.worst for one in effects.values()), reverse=True)
    assert 0.005 < {name: one for (name, _), one in effects.items()}["large strain"].sd_ratio[2, 0] - 1 < 0.06
    by_name = {name: one for (name, _), one in effects.items()}
    firm, soft = FORCES_GF.index(100.0), MODULI_MPA.index(0.1)
    assert -0.05 < by_name["friction"].sd_ratio[firm, soft] - 1 < -0.01
    assert 0.05 < by_name["thickness of the block"].modulus_ratio[firm, soft] - 1 < 0.25
    assert -0.2 < by_name["block not bonded"].modulus_ratio[firm, soft] - 1 < -0.05
    assert by_name["foils in the gauges"].worst > 0.8, "a foil in rubber hardly reads the strain"
    for one in effects.values():
        assert one.sd_ratio.shape == one.modulus_ratio.shape == (len(FORCES_GF), len(MODULI_MPA))
        json.dumps(one.to_json(), allow_nan=False)
