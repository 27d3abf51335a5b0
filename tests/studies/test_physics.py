"""The table of effects: what is known of each."""

import json

import pytest

from papilla.finger import Finger
from papilla.studies.physics import FORCES_GF, MODULI_MPA, physics


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
