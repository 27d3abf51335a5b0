"""Tables of large strain of a finger of one's own: used once they are kept, made press by press, and how good."""

from dataclasses import replace

import numpy as np
import pytest

from papilla import Finger, fem
from papilla.core.errors import InputError
from papilla.fem.finite.strain_tables import FEW_FORCES, FEW_MODULI, ensure_large_strain, measure_large_strain
from papilla.fem.pressing.contact import contact_press
from papilla.fem.pressing.large_strain import LargeStrain, keep, known
from papilla.fem.reduction.gauges import gauge_weights
from papilla.model.finger import Dome
from papilla.model.specimen import Block

OWN = replace(Finger.default(), name="own", shape=Dome((22.0, 22.0, 19.0), (19.5, 19.5, 16.5), (9.0, 9.0, 6.0)))


@pytest.fixture
def kept(monkeypatch, tmp_path):
    """Tables of the default finger as those of one's own, without friction and stuck, in a cache of the test's own."""
    tables = [table for table in known(Finger.default().strain_sha256) if table.ratio == 4.0]
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "cache"))
    keep(OWN.strain_sha256, tables)


def few_of(table: LargeStrain) -> LargeStrain:
    """The presses of a table that a finger of one's own gets."""
    forces, moduli = np.unique(table.force)[list(FEW_FORCES)], np.unique(table.modulus)[list(FEW_MODULI)]
    few = np.isin(table.force, forces) & np.isin(table.modulus, moduli)
    return replace(table, **{name: getattr(table, name)[few] for name in ("force", "modulus", "linear", "finite")})


@pytest.mark.parametrize("stuck", [False, True])
def test_twenty_presses_tell_the_sixteen_others_of_each_shipped_table(stuck):
    """S_d within 0.15 % rms and gauges within 0.5 % of the largest; the table says of itself no less than it is off."""
    weights = gauge_weights(Finger.default())
    for table in known(Finger.default().strain_sha256):
        if (table.friction > 0) != stuck:
            continue
        few = few_of(table)
        assert len(few.force) == 20 and few.changes(5.0, 0.1).shape == (13,)
        told = table.linear + table.fit.norms * few.changes(table.force, table.fit.softness)
        found, true = ((weights * one[:, 3:].reshape(-1, *weights.shape)).sum(axis=1) for one in (told, table.finite))
        off = found.std(axis=1) / true.std(axis=1) - 1
        assert np.sqrt(np.mean(off**2)) < 0.0015
        assert (np.abs(found - true).max(axis=1) / np.abs(true).max(axis=1)).max() < 0.005
        assert few.sd_error(weights) > np.sqrt(np.mean(off**2)) and few.sd_error(weights) < 0.006


def test_a_press_of_a_prepared_finger_includes_large_strain_by_its_tables(kept):
    reduced = fem.prepare(OWN, size_mm=2.8)
    found = fem.press(reduced, Block(0.2, thickness=10.0), force=0.3)
    assert found.large_strain and found.friction == np.inf
    free = fem.press(reduced, Block(0.2, thickness=10.0), force=0.3, friction=0)
    assert free.large_strain and free.friction == 0
    assert ensure_large_strain(OWN, (False, True)) == "", "nothing is missing"


def test_a_table_has_the_presses_that_are_made_one_by_one(dome):
    finger = Finger.default()
    mesh = dome(finger, outer_layers=1, inner_layers=2)
    told, inner = [], finger.inner.modulus
    table = measure_large_strain(
        finger, mesh, forces=(1.0, 3.0, 9.0, 18.0), moduli=(0.5, 4.0, 1e4), steps=lambda *one: told.append(one)
    )
    assert told == [(k, 12) for k in range(1, 13)]
    assert (table.ratio, table.friction) == (pytest.approx(4.0), 0.0)
    assert table.force == pytest.approx(np.tile([1.0, 3.0, 9.0, 18.0], 3))
    assert table.modulus == pytest.approx(np.repeat([0.5, 4.0, 1e4], 4))
    reduced = fem.FingerModel(finger, mesh).reduce()
    for k in (2, 7):
        block, force = finger.bench.specimen(table.modulus[k] * inner), float(table.force[k] * inner)
        alone = fem.press_finite(finger, mesh, block, force=force), contact_press(reduced, block, (force, None))
        for rows, one in zip((table.finite, table.linear), alone, strict=True):
            expected = [one.indentation, one.contact_area, one.peak_pressure / inner, *one.values.ravel()]
            # Presses of a table stop at a relative residual of 1e-4, from which S_d is off by 1e-5
            assert rows[k] == pytest.approx(expected, rel=1e-4, abs=1e-4 * np.abs(one.values).max())
    with pytest.raises(InputError, match="only 2 of 2 presses at finite strain can be made"):
        measure_large_strain(finger, mesh, forces=(1.0, 3.0), moduli=(4.0,))
