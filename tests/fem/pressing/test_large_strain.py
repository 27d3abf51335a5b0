"""What large strain changes in a linear press: the tables, their scaling, where they answer, and the shipped one."""

import dataclasses
import math

import numpy as np
import pytest

from papilla.core import cache
from papilla.fem import press
from papilla.fem.pressing import large_strain
from papilla.fem.pressing.large_strain import LargeStrain, at_ratio, known, softness_in_each
from papilla.model.finger import Finger
from papilla.model.specimen import Block


def _table(ratio=4.0, scale=1.0):
    """Changes that are themselves a polynomial of the two coordinates: a table must tell them exactly."""
    force, modulus = (part.ravel() for part in np.meshgrid(np.geomspace(1, 30, 6), np.geomspace(0.5, 100, 6)))
    x, soft = np.log(force), 1 / modulus
    rigid = 0.3 + 0.6 * x + 0.01 * x**2
    area = np.exp(rigid + soft)
    # The hardest of the table is not quite rigid: softness counts from it
    soft = soft - soft.min()
    linear = np.column_stack([force**0.6, area, force**0.4, *(np.ones((10, len(force))) * np.arange(1, 11)[:, None])])
    change = scale * (0.01 + 0.02 * x - 0.003 * x * soft + 0.01 * soft**2)
    norms = np.sqrt([[(np.arange(1, 6) ** 2).sum()], [(np.arange(6, 11) ** 2).sum()]]).repeat(5, axis=1).ravel()
    sizes = np.append([1, 1, 1], norms) * np.column_stack([linear[:, :3], np.ones((len(x), 10))])
    finite = linear + change[:, None] * sizes
    return LargeStrain(ratio, force, modulus, linear, finite)


def test_a_table_tells_a_polynomial_change_and_its_own_error():
    table = _table()
    x, soft = np.log(7.0), 0.4
    expected = 0.01 + 0.02 * x - 0.003 * x * soft + 0.01 * soft**2
    assert table.changes(7.0, soft) == pytest.approx(np.full(13, expected), rel=1e-6)
    assert np.abs(table.fit.errors).max() < 1e-7
    noise = 1e-3 * np.random.default_rng(3).normal(size=table.finite.shape)
    rough = dataclasses.replace(table, finite=table.finite * (1 + noise))
    assert 1e-4 < rough.sd_error(np.array([[1.0] * 5, [0.0] * 5])) < 1e-2


@pytest.mark.parametrize("beyond, near", [(0.99, True), (1.01, False)])
def test_a_press_near_a_table_is_that_of_its_nearest_press(beyond, near):
    table = _table()
    assert table.nearest(7.0, 0.4) == ((7.0, 0.4), True)
    for end, force in ((30.0, 30.0 * 2.25 * beyond), (1.0, 1.0 / (2.25 * beyond))):
        (found, soft), told = table.nearest(force, 0.4)
        assert (found, soft, told) == (pytest.approx(end), pytest.approx(0.4), near)
    (found, soft), told = table.nearest(40.0, -0.14)
    assert (soft, told) == (pytest.approx(0.0, abs=1e-12), True), "clipped to the softness of the table"


def test_ratios_between_three_tables_are_interpolated_and_none_beyond():
    tables = [_table(ratio) for ratio in (1.0, 2.0, 4.0)]
    assert [weight for _, weight in at_ratio(tables, 2.0001)] == [1.0]
    ratio = 3.0
    weights = [weight for _, weight in at_ratio(tables, ratio)]
    assert sum(weights) == pytest.approx(1)
    assert np.dot(weights, np.log([1.0, 2.0, 4.0]) ** 2) == pytest.approx(np.log(ratio) ** 2)
    assert at_ratio(tables, 5.0) == () and at_ratio(tables[:2], 1.5) == ()
    assert at_ratio([], 2.0) == ()


@pytest.mark.parametrize("ratio, stuck", [(2.0, True), (4.0, False), (8.0, True)])
def test_presses_of_a_ratio_that_is_left_out_are_told_by_the_others(ratio, stuck):
    """At ratio 4 the softest specimen is half as soft again as at 2 (in ln area): it is told, too, and as well."""
    tables = known(Finger.default().strain_sha256)
    truth = next(one for one in tables if one.ratio == ratio and (one.friction > 0) == stuck)
    others = at_ratio([one for one in tables if one is not truth], ratio, stuck)
    for force, linear, finite in zip(truth.force, truth.linear, truth.finite, strict=True):
        pairs = list(zip(others, softness_in_each(others, force, linear[1]), strict=True))
        assert all(table.covers(force, soft) for (table, _), soft in pairs)
        told = sum(weight * table.changes(force, soft) for (table, weight), soft in pairs)
        change = finite - linear
        assert told[0] == pytest.approx(change[0] / linear[0], abs=0.004)
        for gauges, error in ((slice(3, 8), 0.01), (slice(8, 13), 0.02)):
            size = np.linalg.norm(linear[gauges])
            assert told[gauges] == pytest.approx(change[gauges] / size, abs=error)


def test_tables_that_were_measured_are_kept_beside_each_other(tmp_path, monkeypatch):
    monkeypatch.setenv(cache.CACHE_VARIABLE, str(tmp_path))
    assert known("of no finger") == known("") == ()
    large_strain.keep("mine", [_table(2.0)])
    large_strain.keep("mine", [_table(1.0), _table(2.0, scale=2.0)])
    large_strain.keep("mine", [dataclasses.replace(_table(2.0), friction=math.inf)])
    assert [(table.ratio, table.friction) for table in known("mine")] == [(1, 0), (2, 0), (2, math.inf)]
    assert known("mine")[1].changes(7.0, 0.4)[0] == pytest.approx(2 * _table().changes(7.0, 0.4)[0])


def test_a_press_includes_large_strain_unless_it_is_asked_to_be_linear(coarse):
    reduced, specimen = coarse, Block(0.51, 10)
    plain = press(reduced, specimen, force=0.6, fidelity="contact")
    found = press(reduced, specimen, force=0.6)
    assert found.large_strain and not plain.large_strain and found.to_json()["large_strain"]
    free = press(reduced, specimen, force=0.6, friction=0)
    assert 1.02 < free.sd / plain.sd < 1.05 and "large strain included (+" in free.status
    assert np.array_equal(free.pressure, plain.pressure) and free.force == plain.force
    # Silicone sticks: what is not told is stuck
    assert math.isinf(found.friction) and free.friction == plain.friction == 0
    assert found.sd == press(reduced, specimen, force=0.6, friction="stick").sd
    at_depth = press(reduced, specimen, indentation=found.indentation)
    assert at_depth.indentation == pytest.approx(found.indentation, rel=1e-9)
    assert at_depth.force == pytest.approx(0.6, rel=1e-4)
    light = press(reduced, specimen, force=5e-3)
    assert not light.large_strain and light.friction == 0 and "without friction, which is included with" in light.status
