"""The table of effects: what is known of each, and its second path where there is one."""

import json

import numpy as np
import pytest
from scipy.interpolate import LinearNDInterpolator

from papilla.fem.pressing.contact import contact_press
from papilla.finger import Finger
from papilla.specimen import Block
from papilla.studies.physics import FORCES_GF, MODULI_MPA, Bench, NarrowBlock, _PressedBlock, physics


@pytest.fixture(scope="module")
def bench():
    return Bench(Finger.default(), 2.0)


@pytest.mark.slow
def test_a_wide_block_by_finite_elements_is_the_layer_of_the_kernel(bench):
    pressed = bench.plain(0.6, 0.3)
    reduced = bench.reduced
    layer = reduced.specimen_compliance(Block(0.3, 10)) @ pressed.pressure / reduced.patch.mass
    block = NarrowBlock(0.3, 10.0, width=20.0, pressed=pressed, reduced=reduced)
    wide = _PressedBlock.of(10.0, 10.0, block.nu, True)
    place, sunk = wide.sunk(LinearNDInterpolator(reduced.patch.xy, pressed.pressure, fill_value=0.0))
    far = np.hypot(*reduced.patch.xy.T) > 6
    near = np.hypot(*reduced.patch.xy.T) < 12
    found = LinearNDInterpolator(place, sunk / 0.3)(reduced.patch.xy[far & near])
    assert found == pytest.approx(layer[far & near], abs=0.08 * layer.max())


@pytest.mark.slow
def test_a_block_as_wide_as_a_layer_is_one_and_a_narrow_one_gives_way(bench):
    pressed = bench.plain(0.6, 0.1)
    wide, narrow = (
        contact_press(
            bench.reduced,
            NarrowBlock(0.1, 10.0, width=width, pressed=pressed, reduced=bench.reduced),
            (0.6, None),
            0.0,
        )
        for width in (120.0, 14.0)
    )
    assert wide.indentation == pytest.approx(pressed.indentation, rel=1e-3)
    assert narrow.indentation > 1.02 * pressed.indentation


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
