"""Tables of large strain of a finger of one's own: made once when a press asks for them, few presses, and how good."""

from dataclasses import replace

import numpy as np
import pytest

from papilla import Finger, fem
from papilla.errors import InputError
from papilla.fem.finite import strain_tables
from papilla.fem.finite.strain_tables import (
    FEW_FORCES,
    FEW_MODULI,
    FORCES,
    MODULI,
    SPANNING,
    ensure_large_strain,
    measure_few,
)
from papilla.fem.pressing.contact import contact_press
from papilla.fem.pressing.fidelity import including_large_strain
from papilla.fem.pressing.large_strain import LargeStrain, at_ratio, known
from papilla.fem.reduction.gauges import gauge_weights
from papilla.finger import Dome
from papilla.mesh import build
from papilla.specimen import Block

OWN = replace(Finger.default(), name="own", shape=Dome((22.0, 22.0, 19.0), (19.5, 19.5, 16.5), (9.0, 9.0, 6.0)))


def shipped_as(ratio: float, stuck: bool) -> dict:
    """The shipped table of the default finger, as if a finger of one's own had it."""
    tables = known(Finger.default().strain_sha256)
    table = next(one for one in tables if one.ratio == 4.0 and (one.friction > 0) == stuck)
    return replace(table, ratio=ratio).to_json()


@pytest.fixture
def asked(monkeypatch, tmp_path):
    """Which tables were made, none of them by presses."""
    made: list[tuple[float, bool]] = []

    def few(finger, ratio, stuck, say):
        made.append((ratio, stuck))
        say("pressing")
        return shipped_as(ratio, stuck)

    monkeypatch.setattr(strain_tables, "measure_few", few)
    monkeypatch.setattr(strain_tables, "_REFUSED", {})
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "cache"))
    return made


def few_of(table: LargeStrain) -> LargeStrain:
    """The presses of a table that a finger of one's own gets."""
    forces, moduli = np.unique(table.force)[list(FEW_FORCES)], np.unique(table.modulus)[list(FEW_MODULI)]
    kept = np.isin(table.force, forces) & np.isin(table.modulus, moduli)
    rows = {name: getattr(table, name)[kept] for name in ("force", "modulus", "linear", "finite")}
    return replace(table, **rows)


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


def test_the_forces_and_moduli_span_those_of_the_shipped_tables():
    assert {0, len(FORCES) - 1} <= {*FEW_FORCES} and {0, len(MODULI) - 1} <= {*FEW_MODULI}


def test_a_press_of_a_prepared_finger_makes_the_table_that_it_needs_and_includes_large_strain(asked):
    reduced = fem.prepare(OWN, size_mm=2.8)
    assert asked == []
    found = fem.press(reduced, Block(0.2, thickness=10.0), force=0.3)
    assert asked == [(4.0, True)] and found.large_strain and found.friction == np.inf
    fem.press(reduced, Block(0.3, thickness=10.0), force=0.4)
    assert asked == [(4.0, True)]
    free = fem.press(reduced, Block(0.2, thickness=10.0), force=0.3, friction=0)
    assert asked == [(4.0, True), (4.0, False)] and free.large_strain and free.friction == 0


def test_a_finger_without_the_source_of_tables_says_that_it_is_linear(asked):
    model = fem.FingerModel(OWN, build(OWN, 2.8))
    found = fem.press(model.reduce(), Block(0.2, thickness=10.0), force=0.3)
    assert not found.large_strain and asked == [] and "small strain" in found.status


def test_tables_over_the_ratios_are_made_once_and_told(asked):
    said = []
    assert ensure_large_strain(OWN, (False, True), ratios=SPANNING, progress=said.append) == ""
    assert sorted(asked) == sorted((ratio, stuck) for ratio in SPANNING for stuck in (False, True))
    assert [stuck for _, stuck in asked] == [True] * 3 + [False] * 3, "the long ones first"
    assert said == [line for k in range(1, 7) for line in ("pressing", f"large strain: {k} of 6 tables")]
    asked.clear()
    softer = replace(OWN, outer=replace(OWN.outer, modulus=2.2 * OWN.inner.modulus))
    assert ensure_large_strain(softer) == "" and asked == [], "between three ratios the table is interpolated"


def test_what_ships_is_not_measured(asked):
    assert ensure_large_strain(Finger.default(), ratios=SPANNING) == "" and asked == []


def test_a_table_that_cannot_be_made_is_noted_and_not_tried_again(asked, monkeypatch):
    tried = []

    def fails(*given, **more):
        tried.append(given)
        raise InputError("only 3 of 16 presses at finite strain can be made")

    monkeypatch.setattr(strain_tables, "measure_few", fails)
    for _ in range(2):
        assert ensure_large_strain(OWN) == (
            "large strain is not included: only 3 of 16 presses at finite strain can be made"
        )
    assert len(tried) == 1


def test_tables_of_nearly_one_ratio_are_averaged_not_divided():
    """Two of four tables are 3 % of a ratio apart and differ by their errors, which must not grow between others."""
    tables = [LargeStrain.from_json(shipped_as(ratio, False)) for ratio in (1.0, 4.0, 4.12, 16.0)]
    for ratio in (1.5, 2.5, 8.0, 13.0):
        weights = [weight for _, weight in at_ratio(tables, ratio)]
        assert sum(weights) == pytest.approx(1) and np.abs(weights).max() < 1.1


@pytest.mark.slow
def test_a_table_of_ones_own_tells_presses_at_finite_strain_on_a_finer_mesh(monkeypatch, tmp_path):
    """What large strain changes in presses between the table's forces and moduli, on another mesh: S_d within 0.5 %,
    gauges within 1 % of the largest reading, in the middle of the table; 0.7 and 1.2 % where the change turns, between
    the two largest forces. Both sides are presses on nodes of one mesh, which lose the same to it."""
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "cache"))
    said = []
    table = LargeStrain.from_json(measure_few(OWN, 4.0, False, said.append))
    assert len(table.force) == len(said) == 20
    assert said[-1] == "large strain, layers 1 : 4, without friction: press: 20 of 20"
    monkeypatch.setattr(strain_tables, "measure_few", lambda *_, **__: table.to_json())
    mesh = build(OWN, 1.0, variant=3)
    reduced = fem.prepare(OWN, size_mm=1.0, variant=3)
    for modulus, force, sd, gauges in ((0.08, 0.3, 0.005, 0.01), (0.4, 0.75, 0.007, 0.012)):
        block = Block(modulus, thickness=10.0)
        truth = fem.press_finite(OWN, mesh, block, force=force, friction=0)
        nodes = contact_press(reduced, block, (force, None), 0.0)
        found = including_large_strain(reduced, block, nodes)
        assert found.large_strain and abs(truth.sd / nodes.sd - 1) > 0.01
        assert found.sd == pytest.approx(truth.sd, rel=sd)
        assert np.abs(found.reading - truth.reading).max() < gauges * np.abs(truth.reading).max()
