"""Moved contacts and gauges: against contacts solved there, gauges of another design, and their own differences."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.fem import press
from papilla.fem.pressing import off_apex
from papilla.fem.pressing.off_apex import (
    PLACES,
    SHIFTS,
    MovedContact,
    MoveLimits,
    OffApex,
    _shifted,
    _stencil,
    off_apex_change,
)
from papilla.fem.pressing.response import FORCES, MODULI, POLYNOMIAL, LogPolynomial
from papilla.fem.reduction.family import RATIOS, family
from papilla.fem.reduction.gauges import gauge_functionals
from papilla.model.finger import Finger, Slab
from papilla.model.specimen import Block

SIZE_MM = 2.8
BLOCK = Block(1.0, 10.0)
CASES = [(0.4, 0.3), (0.7, 0.3), (0.9, 0.6), (0.9, 0.15)]
"""Presses of many elements: lighter ones on this mesh grow in steps, which the polynomial averages over."""


@pytest.fixture(scope="module")
def relatives():
    return family(Finger.default(), size_mm=SIZE_MM)


@pytest.fixture(scope="module")
def moved(relatives):
    return off_apex_change(relatives, BLOCK, 0.0)


@pytest.fixture(scope="module")
def made_up() -> OffApex:
    """Changes of any shape, which vanish where nothing is moved."""
    terms = len(off_apex.POLYNOMIAL.powers)
    coefficients = np.random.default_rng(4).normal(size=(terms, *PLACES, *SHIFTS, 2, 5))
    coefficients[:, *off_apex.MIDDLE] = 0.0
    return OffApex(coefficients, MoveLimits(5.0, 3.0, np.array([20.0, np.inf])))


@pytest.fixture(scope="module")
def few(dome):
    """A family on a very coarse mesh."""
    return family(Finger.default(), mesh=dome(Finger.default(), divisions=5, outer_layers=1, inner_layers=2))


@pytest.fixture
def small(monkeypatch):
    """Few places, shifts and presses; more places along x than along y, so that these are not taken for each other."""
    degrees = ((FORCES[0], FORCES[-1]), (MODULI[0], MODULI[-1]), RATIOS), (3, 2, 1), 1.5
    values = {"PLACES": (5, 3), "SHIFTS": (3, 3), "MIDDLE": (2, 1, 1, 1), "_AT_APEX": (slice(None), 2, 1, 1, 1)}
    for name, value in {**values, "GRID": (6, 4), "RATIO_NODES": 2, "POLYNOMIAL": LogPolynomial(*degrees)}.items():
        monkeypatch.setattr(off_apex, name, value)


def changed(moved, outer, inner, place=(0.0, 0.0), shift=(0.0, 0.0)):
    force, modulus = np.array(CASES).T
    places = np.tile(np.array(place), (len(CASES), 1))
    return moved.changed(force, modulus, outer, inner, places, np.tile(np.array(shift)[:, None], (1, 5)))


def off(told, before, after):
    """Root mean square, in that of what the gauges feel, of a told change."""
    size = np.sqrt((before**2).mean(axis=2, keepdims=True))
    return np.sqrt(np.mean(((told - (after - before)) / size) ** 2)), np.sqrt(np.mean(((after - before) / size) ** 2))


def presses(member):
    return np.array([press(member, Block(e, 10.0), force=f, fidelity="contact", friction=0.0).values for f, e in CASES])


@pytest.mark.slow
def test_it_is_the_real_contact_beside_the_apex(relatives, moved):
    outer, inner = 0.136, relatives.finger.inner.modulus
    apex = presses(relatives.at(outer, inner))
    for place in ((3.0, 0.0), (2.0, -2.0)):
        there = presses(relatives.model(outer / inner).reduce(place))
        missed, size = off(changed(moved, outer, inner, place).values, apex, there)
        assert missed < 0.1 and size > 4 * missed, place


@pytest.mark.slow
def test_it_is_the_gauge_that_was_moved(relatives, moved):
    outer, inner, shift = 0.17, relatives.finger.inner.modulus, (1.2, -0.8)
    finger = relatives.finger
    design = replace(finger, gauges=tuple(replace(gauge, moved_mm=shift) for gauge in finger.gauges))
    model = relatives.model(outer / inner)
    elsewhere = type(model)(replace(design, outer=model.finger.outer, inner=model.finger.inner), model.mesh)
    before, after = (presses(one.reduce()) for one in (model, elsewhere))
    missed, size = off(changed(moved, outer, inner, shift=shift).values, before, after)
    assert missed < 0.05 and size > 3 * missed


def test_its_slopes_are_derivatives_and_at_the_apex_nothing_changes(made_up):
    moved, outer, inner, place, shift, step = made_up, 0.15, 0.04, np.array([1.0, -2.0]), np.array([0.5, 0.3]), 1e-5
    assert np.abs(changed(moved, outer, inner).values).max() < 1e-12
    told = changed(moved, outer, inner, place, shift)

    def two_sided(make):
        return (make(step).values - make(-step).values) / (2 * step)

    x, y = np.eye(2)
    differences = {
        "ratio": two_sided(lambda h: changed(moved, outer * np.exp(h), inner, place, shift)),
        "x": two_sided(lambda h: changed(moved, outer, inner, place + h * x, shift)),
        "y": two_sided(lambda h: changed(moved, outer, inner, place + h * y, shift)),
        "along": two_sided(lambda h: changed(moved, outer, inner, place, shift + h * x)),
        "across": two_sided(lambda h: changed(moved, outer, inner, place, shift + h * y)),
    }
    for name, slope in differences.items():
        assert told.slopes[name] == pytest.approx(slope, abs=1e-6 * np.abs(slope).max()), name
    scaled = changed(moved, outer * np.exp(step), inner * np.exp(step), place, shift).values - told.values
    homogeneous = -sum(told.slopes[name] for name in ("force", "modulus"))
    assert scaled / step == pytest.approx(homogeneous, abs=1e-3 * np.abs(homogeneous).max())


def test_what_is_too_far_is_refused(made_up):
    moved = made_up
    changed(moved, 0.136, 0.034, place=(5.0, -5.0), shift=(-3.0, 3.0))
    with pytest.raises(InputError, match="contacts must lie within 5 mm along x and y, got 6 mm"):
        changed(moved, 0.136, 0.034, place=(6.0, 0.0))
    with pytest.raises(InputError, match="shifts must lie within 3 mm along x and y, got 4 mm"):
        changed(moved, 0.136, 0.034, shift=(0.0, 4.0))
    assert "contacts within 5 mm, gauges within 3 mm)" in repr(moved)


def test_presses_of_a_family_span_those_of_a_bench_with_the_default_finger():
    inner = Finger.default().inner.modulus
    assert FORCES[[0, -1]] * inner == pytest.approx([5.1e-3, 4.4], rel=0.01)
    assert MODULI[[0, -1]] * inner == pytest.approx([5.1e-3, 20.4], rel=0.01)


def test_its_polynomial_spans_the_presses_of_the_response():
    ends = [(values[0], values[-1]) for values in (FORCES, MODULI, RATIOS)]
    assert [*off_apex.POLYNOMIAL.limits] == [*POLYNOMIAL.limits] == ends
    assert (np.diff(FORCES) > 0).all() and (np.diff(MODULI) > 0).all()


def test_its_nodes_are_what_was_fitted(made_up):
    """At a node of places and shifts all other nodes weigh nothing; each gauge has its own shift."""
    x, y, along, across = 6, 1, 0, 2
    place = np.array([[5.0, -5.0 * np.sqrt(0.5)]])
    shift = np.zeros((2, 5))
    shift[:, 3] = -3.0, 3.0
    found = made_up.changed(np.array([0.4]), np.array([0.3]), 0.15, 0.04, place, shift).values[0]
    terms = off_apex.POLYNOMIAL.terms((np.array([10.0]), np.array([7.5]), np.array([3.75])))[0, 0]
    still = 10.0 * np.einsum("t,tqg->qg", terms, made_up.coefficients[:, x, y, 2, 1])
    moved = 10.0 * np.einsum("t,tqg->qg", terms, made_up.coefficients[:, x, y, along, across])
    assert found[:, :3] == pytest.approx(still[:, :3], rel=1e-9)
    assert found[:, 3] == pytest.approx(moved[:, 3], rel=1e-9)


def test_a_fit_to_few_presses_tells_moved_contacts(few, small):
    """The change at a node is that of the same tractions, moved there, and nearly so between the nodes."""
    said: list[str] = []
    found = off_apex._made(few, BLOCK, 0.0, said.append)
    made = OffApex(found, MoveLimits.of(few))
    assert np.linalg.norm(found) == pytest.approx(0.0633560889, rel=1e-6), "pinned: another number is another result"
    assert [line[:20] for line in said] == ["contacts off the ape", *["gauges and contacts "] * 2]
    assert said[1].endswith("ratio 1 (1 of 2)") and said[2].endswith("ratio 4 (2 of 2)")
    model, inner, reach = few.model(4.0), few.finger.inner.modulus, made.limits.reach
    pressed, traction = off_apex._presses(few, 4.0, BLOCK, 0.0)
    assert pressed[:, 2] == pytest.approx(4.0) and len(pressed) > 12
    force = few.reduced.multiplicity * traction[:, 0] @ few.reduced.patch.mass
    assert force == pytest.approx(pressed[:, 0] * inner, rel=1e-6)
    for share, most in ((1.0, 0.2), (0.4, 0.3)):
        aside = MovedContact.at(model, few.reduced.patch, (share * reach, 0.0))
        here = MovedContact.at(model, few.reduced.patch, (0.0, 0.0))
        fields = off_apex.on_each_side(model.adjoints(gauge_functionals(few.finger, model.surfaces["interface"])))
        felt = [np.einsum("kcn,mcn->mk", one.rows(fields), traction).reshape(-1, 2, 5) for one in (here, aside)]
        place, shift = np.tile([share * reach, 0.0], (len(pressed), 1)), np.zeros((2, 5))
        told = made.changed(pressed[:, 0] * inner, pressed[:, 1] * inner, 4 * inner, inner, place, shift).values
        size = np.sqrt(np.mean((felt[1] - felt[0]) ** 2, axis=2, keepdims=True))
        assert np.median(np.abs(told - (felt[1] - felt[0])) / size) < most


def test_a_change_is_made_once_for_each_shape_of_specimen_and_friction(few, monkeypatch, tmp_path):
    made = []
    coefficients = np.zeros((len(off_apex.POLYNOMIAL.powers), *PLACES, *SHIFTS, 2, 5))

    def make(family, specimen, friction, progress):
        made.append((specimen, friction))
        return coefficients + len(made)

    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path))
    monkeypatch.setattr(off_apex, "_made", make)
    scenes = (BLOCK, 0.0), (replace(BLOCK, modulus=7.0), 0.0), (BLOCK, "stick"), (Block(1.0, 9.0), 0.0), (BLOCK, 0.0)
    found = [off_apex_change(few, *scene) for scene in scenes]
    assert [one.coefficients.flat[0] for one in found] == [1, 1, 2, 3, 1]
    assert made == [scenes[0], scenes[2], scenes[3]]
    assert found[2].limits.reach == MoveLimits.of(few).reach


def test_how_many_presses_are_moved_is_pinned():
    """The size of a fit, whose error would hardly tell one node or press more or less."""
    assert (off_apex.GRID, off_apex.RATIO_NODES) == ((12, 10), 5)
    assert (off_apex.POLYNOMIAL.degrees, len(off_apex.POLYNOMIAL.powers)) == ((6, 5, 4), 107)
    assert (off_apex.PLACES, off_apex.SHIFTS, off_apex.WIDTH_MM) == ((7, 5), (5, 3), 48.0)


def test_limits_go_with_the_width(few):
    """The default finger is 48 mm wide; its skin rolls by its radii at the apex."""
    room = MoveLimits.of(few)
    a, b, c = few.finger.shape.outer
    assert (room.reach, room.shift) == pytest.approx((5.0, 3.0))
    assert room.rolling == pytest.approx([a**2 / c, b**2 / c], rel=0.25)


def test_gauges_are_shifted_from_where_they_were():
    design = replace(Finger.default(), gauges=tuple(replace(g, moved_mm=(0.1, 0.2)) for g in Finger.default().gauges))
    assert {gauge.moved_mm for gauge in _shifted(design, np.array([1.0, -2.0])).gauges} == {(1.1, -1.8)}
    assert _stencil(SHIFTS)[1] == (-1.0, 0.0) and _stencil(SHIFTS)[7] == (0.0, 0.0) and len({*_stencil(SHIFTS)}) == 15
    assert off_apex._points(5) == pytest.approx([-1, -np.sqrt(0.5), 0, np.sqrt(0.5), 1], abs=1e-15)


@pytest.mark.slow
def test_a_skin_rolls_by_its_radius(relatives):
    room = MoveLimits.of(relatives)
    a, b, c = relatives.finger.shape.outer
    assert room.rolling == pytest.approx([a**2 / c, b**2 / c], rel=0.01)
    straight = family(replace(Finger.default(), shape=Slab((24.0, 20.0), (21.0, 17.0), (10.0, 6.0), 20.0)), size_mm=2.8)
    assert np.isinf(MoveLimits.of(straight).rolling[1])
