"""Tables of large strain of a finger of one's own: used once they are kept, made press by press, and how good."""

from dataclasses import replace

import numpy as np
import pytest
from scaled_finger import scaled_finger, without_lengths

from papilla import Finger, fem
from papilla.core.errors import InputError
from papilla.design.geometry import borrow
from papilla.fem.finite.strain_tables import PressedFinger, ensure_large_strain, measure_large_strain
from papilla.fem.pressing.contact import contact_press
from papilla.fem.pressing.large_strain import keep, known
from papilla.mesh import default_size_mm
from papilla.mesh.body import narrowest_mm
from papilla.model.finger import Dome
from papilla.model.specimen import Block

OWN = replace(Finger.default(), name="own", shape=Dome((22.0, 22.0, 19.0), (19.5, 19.5, 16.5), (9.0, 9.0, 6.0)))


@pytest.fixture
def kept(monkeypatch, tmp_path):
    """Tables of the default finger as those of one's own, without friction and stuck, in a cache of the test's own."""
    tables = [table for table in known(Finger.default().strain_sha256) if table.ratio == 4.0]
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "cache"))
    keep(OWN.strain_sha256, tables)


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
    forces, moduli = (1.0, 3.0, 9.0, 18.0), (0.5, 4.0, 1e4)
    height = narrowest_mm(finger)
    table = measure_large_strain(
        PressedFinger(finger, mesh), forces=np.array(forces) / height**2, moduli=moduli, progress=told.append
    )
    assert [(step.done, step.total) for step in told] == [(k, 12) for k in range(1, 13)]
    assert (table.ratio, table.friction) == (pytest.approx(4.0), 0.0)
    assert table.force == pytest.approx(np.tile(forces, 3)) and table.modulus == pytest.approx(np.repeat(moduli, 4))
    reduced = fem.FingerModel(finger, mesh).reduce()
    for k in (2, 7):
        block, force = finger.bench.specimen(table.modulus[k] * inner), float(table.force[k] * inner)
        alone = fem.press_finite(finger, mesh, block, force=force), contact_press(reduced, block, (force, None))
        for rows, one in zip((table.finite, table.linear), alone, strict=True):
            expected = [one.indentation, one.contact_area, one.peak_pressure / inner, *one.values.ravel()]
            # Presses of a table stop at a relative residual of 1e-4, from which S_d is off by 1e-5
            assert rows[k] == pytest.approx(expected, rel=1e-4, abs=1e-4 * np.abs(one.values).max())
    with pytest.raises(InputError, match="only 2 of 2 presses at finite strain can be made"):
        measure_large_strain(PressedFinger(finger, mesh), forces=(0.0025, 0.0075), moduli=(4.0,))


@pytest.mark.slow
@pytest.mark.parametrize("length, stress", [(0.3, 10.0), (3.0, 0.1)])
def test_a_finger_of_any_size_includes_large_strain_over_the_same_range(length, stress, monkeypatch, tmp_path):
    """And says the same of presses within its tables, beyond them, and where it falls back to another press."""
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path))
    answers = []
    for of_length, of_stress in ((1.0, 1.0), (length, stress)):
        finger = scaled_finger(Finger.default(), of_length, of_stress)
        borrow(finger, Finger.default())
        reduced = fem.prepare(finger, size_mm=4 * default_size_mm(finger))
        for force in (0.3, 1.1, 1.9):
            pressed = fem.press(reduced, finger.bench.specimen(0.3 * of_stress), force=force * of_length**2 * of_stress)
            answers.append((without_lengths(pressed.status), pressed.large_strain, pressed.friction, pressed.sd))
    plain, scaled = answers[:3], answers[3:]
    assert [answer[:3] for answer in scaled] == [answer[:3] for answer in plain] and plain[0][1]
    assert [answer[3] for answer in scaled] == pytest.approx([answer[3] for answer in plain], rel=1e-6)
