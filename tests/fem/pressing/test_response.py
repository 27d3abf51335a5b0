"""The smooth response of a family against presses of its members, and its derivatives against differences."""

from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.fem import press
from papilla.fem.pressing import response as module
from papilla.fem.pressing.response import FORCES, MODULI, POLYNOMIAL, Response, _fitted, response
from papilla.fem.reduction.family import family
from papilla.model.finger import Finger
from papilla.model.specimen import Block

SIZE_MM = 2.8


@pytest.fixture(scope="module")
def relatives():
    return family(Finger.default(), size_mm=SIZE_MM)


@pytest.fixture(scope="module")
def smooth(relatives):
    """Made of a quarter of the presses, over the same range."""
    with pytest.MonkeyPatch.context() as patch:
        for name, count in (("FORCES", 10), ("MODULI", 8)):
            values = getattr(module, name)
            patch.setattr(module, name, np.geomspace(values[0], values[-1], count))
        return response(relatives, Block(1.0, 10.0))


FORCE, MODULUS = np.array([0.1, 0.3, 0.6, 1.0, 1.0]), np.array([0.3, 0.089, 0.5, 0.72, 0.089])


@pytest.mark.parametrize("outer, inner", [(0.136, 0.034), (0.1, 0.06), (0.2, 0.018)])
def test_it_tells_presses_of_fingers_of_the_family(relatives, smooth, outer, inner):
    member = relatives.at(outer, inner)
    presses = [press(member, Block(e, 10.0), force=f) for f, e in zip(FORCE, MODULUS, strict=True)]
    told = smooth.felt(FORCE, MODULUS, outer, inner)
    expected = np.array([one.values for one in presses])
    # Contact on this coarse mesh, unlike from one to the next, grows in steps, which the response averages over
    size = np.sqrt((expected**2).mean(axis=2, keepdims=True))
    assert np.abs((told.values - expected) / size).max() < 0.4
    assert told.indentation == pytest.approx([one.indentation for one in presses], rel=0.12)
    assert np.sqrt(np.mean(((told.values - expected) / size) ** 2)) < 0.1
    assert smooth.inside(FORCE, MODULUS, outer, inner).all()


def test_its_size_is_pinned():
    """Presses and terms of the fit, and which presses it is judged by: an error would hardly tell one more or less."""
    assert (len(FORCES), len(MODULI), POLYNOMIAL.powers.shape, POLYNOMIAL.degrees) == (20, 16, (183, 3), (8, 7, 4))
    assert (module.FOLDS, module.USUAL) == (5, ((1.0, 60.0), (1.0, 60.0)))


def test_it_is_pinned(smooth):
    """Whoever changes these numbers changes a result; what they should be is told by the presses above."""
    told = smooth.felt([0.3, 2.0], [0.2, 0.9], 0.15, 0.04)
    assert told.indentation == pytest.approx([0.568740564, 1.63466033], rel=1e-6)
    assert told.values[0, 0, :3] == pytest.approx([-0.00437646468, -0.0119234909, 0.0284007866], rel=1e-6)
    assert told.values[1, 1, :3] == pytest.approx([-0.00844714442, -0.0158616151, 0.0349458604], rel=1e-6)
    expected = [0.00205705375, 0.00143996128, 0.00606538538, 0.0179896293]
    assert smooth.error[:4] == pytest.approx(expected, rel=1e-5)
    assert (smooth.strained, smooth.deepest[2].sum()) == pytest.approx((28.9126122, 4177.91234), rel=1e-6)


def test_its_slopes_are_derivatives(smooth):
    outer, inner, step = 0.15, 0.04, 1e-5
    told = smooth.felt(FORCE, MODULUS, outer, inner)
    sides = {
        0: [smooth.felt(FORCE * np.exp(sign * step), MODULUS, outer, inner) for sign in (1, -1)],
        1: [smooth.felt(FORCE, MODULUS * np.exp(sign * step), outer, inner) for sign in (1, -1)],
        2: [smooth.felt(FORCE, MODULUS, outer * np.exp(sign * step), inner) for sign in (1, -1)],
    }
    for k, (up, down) in sides.items():
        for name in ("values", "indentation"):
            slope = (getattr(up, name) - getattr(down, name)) / (2 * step)
            found = getattr(told, f"slope_{name}")[k]
            assert found == pytest.approx(slope, abs=1e-7 * np.abs(slope).max())


def test_moduli_and_forces_in_other_units_feel_the_same(smooth):
    one, other = (smooth.felt(k * FORCE, k * MODULUS, k * 0.15, k * 0.04) for k in (1.0, 3.0))
    assert other.values == pytest.approx(one.values, rel=1e-9)
    assert other.indentation == pytest.approx(one.indentation, rel=1e-9)


def test_what_it_was_not_made_of_is_told(smooth):
    assert not smooth.inside([50.0], [0.5], 0.136, 0.034)[0]
    assert not smooth.inside([0.5], [100.0], 0.136, 0.034)[0]
    assert smooth.strained < np.inf and smooth.large_strain and np.isinf(smooth.friction)
    assert "block 10 mm thick" in repr(smooth)


def test_the_deepest_press_is_that_of_the_nearest_ratio_of_the_moduli(smooth):
    rows = {}
    for modulus, ratio, top in smooth.deepest.T:
        rows.setdefault(ratio, {})[modulus] = top
    made = replace(
        smooth,
        deepest=np.array([(e, r, top * (1 + k)) for k, r in enumerate(sorted(rows)) for e, top in rows[r].items()]).T,
    )
    inner = 0.03
    for k, ratio in enumerate(sorted(rows)):
        modulus, top = next(iter(rows[ratio].items()))
        force = np.array([0.99, 1.01]) * top * (1 + k) * inner
        found = made.inside(force, np.full(2, modulus * inner), ratio * inner * 1.02, inner)
        assert found.tolist() == [True, False]


def columns_of(loads, change=lambda values: values, resolved=True, known=True):
    """Columns of made-up presses of two gauges, whose quantities over the load are polynomials; and these."""
    x, modulus, ratio = np.array(loads).T
    values = np.column_stack([1 + 0.1 * np.log(x), 2 + 0 * x, -2 + 0 * x, np.log(modulus), 1 + np.log(ratio) ** 2])
    felt = change(values) * np.column_stack([x ** (2 / 3), x, x, x, x])
    return [np.array(loads), np.full(len(x), resolved), np.full(len(x), known), felt], values


LOADS = list(product(FORCES[::2], MODULI[::2], np.geomspace(1.0, 16.0, 7)))


def test_polynomials_are_recovered_and_presses_told_apart():
    columns, values = columns_of([one for one in LOADS if one[0] < 60 or one[1] > 10])
    places, _, known, _ = columns
    known &= places[:, 0] <= 20
    found = _fitted(*columns)
    terms = POLYNOMIAL.terms(tuple(places.T))[0]
    assert terms @ found["coefficients"] == pytest.approx(values, abs=1e-8)
    assert found["error"].shape == (5,) and found["error"].max() < 1e-8
    assert found["strained"] == places[known, 0].max()
    stiff = found["deepest"][0] > 10
    assert found["deepest"].shape == (3, 8 * 7)
    assert (found["deepest"][2, stiff] == FORCES[::2].max()).all()
    assert (found["deepest"][2, ~stiff] == FORCES[FORCES < 60][::2].max()).all()


def test_the_error_is_that_of_presses_left_out_over_the_mean_of_the_gauges():
    rng = np.random.default_rng(3)
    scatter = [0.0, 0.04, 0.0, 0.0, 0.0] * rng.choice([-1, 1], (len(LOADS), 1))
    columns, _ = columns_of(LOADS, lambda values: values + scatter)
    error = _fitted(*columns)["error"]
    terms = POLYNOMIAL.terms(tuple(columns[0].T))[0]
    # A press left out of a fit to n presses with m terms is missed by sqrt(1 + m / n) of the scatter
    assert error[1] == pytest.approx(0.04 / 2 * np.sqrt(1 + len(terms.T) / (0.8 * len(LOADS))), rel=0.15)
    assert error[[0, 2, 3, 4]].max() < 1e-8


def test_presses_too_light_for_the_mesh_count_a_tenth():
    """The value of presses on one load, resolved or not, is their mean with the weights 1 and 0.1 squared."""
    (resolved, values), (light, _) = columns_of(LOADS), columns_of(LOADS, lambda values: 2 * values, resolved=False)
    found = _fitted(*(np.concatenate(both) for both in zip(resolved, light, strict=True)))
    terms = POLYNOMIAL.terms(tuple(resolved[0].T))[0]
    assert terms @ found["coefficients"] == pytest.approx(values * (1 + 0.01 * 2) / 1.01, abs=1e-8)


def test_few_presses_are_refused(monkeypatch):
    """One press fewer than twice the terms of the polynomial, of 20 forces on 16 specimens of two fingers."""
    made = [((1.0, 1.0, 1.0), True, True, (1.0,))] * (2 * len(POLYNOMIAL.powers) - 1)
    monkeypatch.setattr(module, "_presses", lambda member, ratio, *_: made if ratio == 1 else [])
    monkeypatch.setattr(module.cache, "fetch", lambda kind, key, make: make())
    monkeypatch.setattr(module, "is_known", lambda *_: False)
    monkeypatch.setattr(module, "tables_of", lambda *_: ())
    reduced = SimpleNamespace(to_arrays=lambda: {}, gauge_names=("g",))
    some = SimpleNamespace(finger=Finger.default(), ratios=np.array([1.0, 2.0]), at=lambda *_: None, reduced=reduced,
                           compliance=np.zeros(1), rows=np.zeros(1))  # fmt: skip
    with pytest.raises(InputError, match=f"only {len(made)} of 640 presses"):
        response(some, Block(1.0, 10.0))


def test_a_press_is_inside_up_to_the_deepest_one_at_the_nearest_ratio():
    """Made-up rows of E / E_inner, ratio and largest x: at twice the ratio the largest x is twice as large."""
    deepest = np.array([(e, ratio, 3.0 * ratio) for ratio in (2.0, 4.0) for e in (1.0, 100.0)]).T
    made = Response(np.zeros((1, 1)), deepest, np.inf, 0.0, False, np.zeros(1), 1, "made up")
    x = np.array([0.99, 1.01])
    for ratio, top in ((1.9, 6.0), (2.7, 6.0), (3.0, 12.0), (5.0, 12.0)):
        assert made.inside(0.03 * top * x, np.full(2, 0.3), ratio * 0.03, 0.03).tolist() == [True, False]
