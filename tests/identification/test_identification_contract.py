"""What an identification must hold for any finger, over a hundred that are drawn.

They press as their family's smooth response says, so they cost no finite elements. Where a contract is about gauges
alone the moduli are held, which leaves a linear fit.
"""

from dataclasses import replace

import numpy as np
import pytest
from drawn_finger import BLOCK, SIZE_MM, made, pulls

from papilla.core.errors import InputError
from papilla.fem.pressing.response import response
from papilla.identification import PARAMETERS_BY_NAME, diagnose, identify, record
from papilla.identification.fit import solve
from papilla.identification.parameters import kind
from papilla.identification.posing import family_of
from papilla.model.finger import Finger

pytestmark = pytest.mark.slow
FINGERS, REFITTED = range(1000, 1100), 40
"""Seeds of the fingers; and of how many of them gauges are fitted again and again."""
GAUGES, EVERY = 5, 5
"""Of the fingers, where each takes the time of a whole fit."""
COLUMNS = ("force_N", "modulus_MPa", "readings", "indentation_mm")
LAYERS = ("outer_modulus_MPa", "inner_modulus_MPa")


@pytest.fixture(scope="module")
def drawn():
    """For each finger its log and its parameters."""
    smooth = response(family_of(Finger.default(), size_mm=SIZE_MM), BLOCK)
    return [made(smooth, seed) for seed in FINGERS]


@pytest.fixture(scope="module")
def found(drawn):
    """What is identified from each log."""
    return [identify(log, Finger.default(), size_mm=SIZE_MM) for log, _ in drawn]


@pytest.fixture(scope="module")
def gauges(drawn):
    """What is identified of gauges and bench from each log, the moduli held at the truth."""
    return [held(log, truth) for log, truth in drawn[:REFITTED]]


def held(log, truth):
    return identify(log, Finger.default(), fix={name: truth[name] for name in LAYERS}, size_mm=SIZE_MM)


def again(one, readings):
    """That fit with other readings of the same presses."""
    log = replace(one.problem.log, readings=readings)
    return solve(replace(one.problem, log=log, weights=None, robust=None, gains=None))


def rows_of(log, rows):
    return replace(log, **{name: getattr(log, name)[rows] for name in COLUMNS})


def of(found, name):
    return np.array([found.values[f"{name}.g{k}"] for k in range(1, GAUGES + 1)])


def test_simulated_fingers_are_recovered_within_what_is_stated(drawn, found):
    """95 % intervals hold, less three binomial standard errors of so many fingers; 68 % are not held by nearly all."""
    gathered = {}
    for one, (_, truth) in zip(found, drawn, strict=True):
        for name, values in pulls(one, truth).items():
            gathered.setdefault(name, []).extend(np.abs(values))
    least = 0.95 - 3 * np.sqrt(0.95 * 0.05 / len(drawn))
    assert {kind(name) for name in found[0].names} == set(gathered)
    for name, values in gathered.items():
        assert np.mean(np.array(values) < 1.96) > least, name
        assert np.mean(np.array(values) < 0.994) < 0.98, name


def test_saved_and_loaded_is_the_same(gauges, tmp_path):
    for one in gauges:
        finger = one.with_record(record(one, diagnose(one), "block"))
        finger.save(tmp_path / "finger.toml")
        assert Finger.load(tmp_path / "finger.toml") == finger


def test_a_gauge_wired_backwards_has_the_negative_gain_and_changes_nothing_else(gauges):
    for number, one in enumerate(gauges):
        sign = np.where(np.arange(GAUGES) == number % GAUGES, -1.0, 1.0)
        turned = again(one, one.problem.log.readings * sign)
        for name in ("gain", "lever_mm", "zero_microstrain"):
            spread = max(one[f"{name}.g{k}"][1] for k in range(1, GAUGES + 1))
            assert np.abs(of(turned, name) - sign * of(one, name)).max() < 0.1 * spread
        assert turned.chi_square == pytest.approx(one.chi_square, rel=0.05)


def test_presses_in_another_order_are_the_same_presses(drawn, gauges):
    rng = np.random.default_rng(0)
    for (log, truth), one in list(zip(drawn[:REFITTED], gauges, strict=True))[::EVERY]:
        other = held(rows_of(log, rng.permutation(len(log))), truth)
        assert np.abs((other.vector - one.vector) / one.sigma).max() < 1e-2


def test_a_dead_gauge_is_named(gauges):
    for number, one in enumerate(gauges):
        dead, rng = number % GAUGES, np.random.default_rng(number)
        readings = one.problem.log.readings.copy()
        readings[:, dead] = 3.0 + rng.normal(size=len(readings))
        told = diagnose(again(one, readings))
        assert any(doubt.startswith(f"g{dead + 1} hardly follows the presses") for doubt in told.doubts)
        assert told.status.startswith("doubtful")


def test_swapped_readings_fit_where_gauges_mirror_each_other_and_are_doubted_elsewhere(gauges):
    """The dome has a mirror plane: g1 and g5 swapped are their gains swapped. Others read another curve over force."""
    wrong = 0
    for number, one in enumerate(gauges):
        mirrored = again(one, one.problem.log.readings[:, [4, 1, 2, 3, 0]])
        spread = max(one["gain.g1"][1], one["gain.g5"][1])
        assert np.abs(of(mirrored, "gain")[[4, 0]] - of(one, "gain")[[0, 4]]).max() < 3 * spread
        order = np.arange(GAUGES)
        pair = ((1, 2), (2, 3), (0, 2))[number % 3]
        order[list(pair)] = order[list(pair)[::-1]]
        swapped = again(one, one.problem.log.readings[:, order])
        if swapped.chi_square > 2 * swapped.freedom:
            wrong += 1
            told = diagnose(swapped)
            assert told.status.startswith("doubtful") and any("does not fit" in doubt for doubt in told.doubts)
    assert wrong > len(gauges) / 10


def test_presses_that_do_not_vary_say_so(drawn):
    for log, truth in drawn[::EVERY]:
        for rows in ([3] * 6, [3]):
            told = diagnose(held(rows_of(log, rows), truth))
            assert any("one and the same scene" in doubt for doubt in told.doubts)
        told = diagnose(held(rows_of(log, slice(4)), truth))
        assert any("all presses are on one modulus" in doubt for doubt in told.doubts)


@pytest.mark.parametrize(
    "column, factor, message",
    [
        ("force_N", 1 / 0.00980665, "is force_N in N"),
        ("modulus_MPa", 1000.0, "is it in kPa"),
        ("readings", 1e-6, "are these strains"),
    ],
)
def test_another_unit_is_refused(drawn, column, factor, message):
    for log, _ in drawn:
        with pytest.raises(InputError, match=message):
            identify(replace(log, **{column: factor * getattr(log, column)}), Finger.default(), size_mm=SIZE_MM)


def test_all_parameters_have_a_unit_a_prior_and_a_source():
    for name, one in PARAMETERS_BY_NAME.items():
        assert one.sigma > 0 and one.low < 0 < one.high and one.source, name
