"""Places of gauges: greedy choice and exchange against all sets, and the rows of influence against presses."""

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from papilla import fem
from papilla.design.influence import Influence, influence
from papilla.design.placement import (
    UNKNOWN_SCENES,
    Placed,
    PlacementProblem,
    place,
    places_figure,
    problem,
    sigma_figure,
)
from papilla.design.scene import DesignScene
from papilla.estimators.softness.touch import TOUCH_RULES
from papilla.model.finger import Finger, Gauge


def made_up(seed: int, k: int = 14) -> PlacementProblem:
    """A row of k places, touched in six ways; slopes are smooth along the row, and neighbours overlap."""
    rng = np.random.default_rng(seed)
    x = np.linspace(-1, 1, k)
    waves = np.array([np.cos(n * x) for n in range(4)] + [np.sin(n * x) for n in (1, 2)])
    slopes = np.einsum("pin,nk->pki", rng.standard_normal((6, 6, 6)) * [1.0, 1.0, 0.7, 0.5, 0.5, 0.3], waves)
    prior = np.tile(np.diag([1.0, 4.0, 4.0, 1.0, 1.0, 9.0]), (6, 1, 1))
    overlap = np.abs(np.subtract.outer(np.arange(k), np.arange(k))) < 2
    return PlacementProblem(slopes, 0.05 + 0.1 * rng.random((6, k)), prior, overlap)


def brute_force(one: PlacementProblem, count: int) -> list[int]:
    """The best of all sets, by exhaustive search."""
    sets = (list(s) for s in combinations(range(one.overlap.shape[0]), count))
    free = (s for s in sets if not any(one.overlap[a, b] for a, b in combinations(s, 2)))
    return min(free, key=one.sigma)


@pytest.mark.parametrize("seed", range(6))
def test_greedy_choice_with_exchange_finds_the_best_set_of_a_small_grid(seed):
    one = made_up(seed)
    for count, chosen in enumerate(place(one, 4), start=1):
        assert one.sigma(chosen) == pytest.approx(one.sigma(brute_force(one, count)), rel=1e-9)


def test_the_update_for_a_further_gauge_is_the_inverse_with_it():
    one = made_up(3)
    after = one.better([2, 9])
    for k in (0, 5, 13):
        assert after[k] == pytest.approx(one.sigma([2, 9, k]) ** 2, rel=1e-10)
    assert np.isinf(after[[1, 2, 3, 8, 9, 10]]).all()


def test_there_are_as_many_gauges_as_there_is_room_for():
    one = made_up(0)
    among = np.arange(14) < 3
    assert [len(chosen) for chosen in place(one, 5, among)] == [1, 2]


def drawn_influence(sites) -> Influence:
    """Random readings of gauges at some sites in touches at 0.2 and 0.8 N."""
    rng, k = np.random.default_rng(4), len(sites)
    gauges = tuple(Gauge(f"p{k}", angle_deg=x, y_mm=y, backing_mm=(5.0, 2.0)) for k, (x, y, _) in enumerate(sites))
    reading, slopes = rng.normal(0, 900, (2, k)), rng.normal(0, 500, (5, 2, k))
    return Influence(gauges, np.array(sites, float), reading, slopes, np.array([0.2, 0.8]))


def test_a_problem_has_the_doubts_of_its_scene():
    """Variances of independent errors add; a quantity that is known has no variance; foils that touch fit."""
    scene = DesignScene(place_mm=1.5, samples=25)
    doubts = scene.unknown.doubts
    found = drawn_influence([(0, 0.0, 0), (0, 4.9, 0), (0, 9.9, 0), (0, 14.9, 0)])
    one = problem(found, scene)
    assert one.slopes[1, 2] == pytest.approx([*found.slopes[:, 1, 2], found.reading[1, 2]])
    noise = scene.gauge_noise_microstrain**2 / 25 + (TOUCH_RULES.air_share * doubts.zero_microstrain) ** 2
    share = (one.variance - noise) / found.reading**2
    assert share == pytest.approx(np.full((2, 4), 0.004**2 + 0.03**2 + doubts.gauge_gain**2))
    assert one.overlap[0, 0] and one.overlap[0, 1] and not one.overlap[1, 2]
    sigmas = np.sqrt(1 / np.diagonal(one.prior, axis1=1, axis2=2))
    offset = (TOUCH_RULES.air_share * doubts.force_offset_N) ** 2 + scene.force_noise_N**2 / 25
    for sigma, force in zip(sigmas, found.force_N, strict=True):
        ln_force = math.sqrt(doubts.force_gain**2 + offset / force**2)
        assert sigma == pytest.approx([1.0, ln_force, 0.5, 1.5, 1.5, doubts.creep])
    sure = problem(found, scene, friction=False, place=False)
    assert (np.sqrt(1 / np.diag(sure.prior[0]))[2:5] < 1e-8).all() and sure.sigma([0, 2]) <= one.sigma([0, 2])


def test_placed_gauges_are_numbered_along_x_and_then_y():
    found = drawn_influence([(3, 0.0, 1), (-3, 2.0, 1), (3, -3.0, 1)])
    sigma = {
        "anywhere": {name: [0.6, 0.3, 0.2] for name in UNKNOWN_SCENES},
        "in a row": {name: [0.9, 0.45] for name in UNKNOWN_SCENES},
    }
    placed = Placed(Finger.default(), found, [[0], [0, 1], [0, 1, 2]], [[0], [0, 1]], sigma, [])
    gauges = [(gauge.name, gauge.angle_deg, gauge.y_mm) for gauge in placed.of([0, 1, 2]).gauges]
    assert gauges == [("g1", -3.0, 2.0), ("g2", 3.0, -3.0), ("g3", 3.0, 0.0)]
    assert placed.sentences[:2] == [
        "3 gauges anywhere give sigma 0.2 of ln E (rms over the scene), one 0.6",
        "2 gauges anywhere leave 0.3, 2 in a row at y = 0 leave 0.45",
    ]


@pytest.mark.slow
def test_rows_of_influence_read_what_presses_read_and_a_row_cannot_see_y():
    finger, scene = Finger.default(), DesignScene(forces=2, moduli=2)
    found = influence(finger, scene)
    k = [(g.angle_deg, g.y_mm, g.direction_deg) for g in found.gauges].index((20.0, 0.0, 0.0))
    reduced = fem.prepare(finger)
    for row, (force, modulus) in enumerate([(0.2, 0.05), (0.2, 0.72), (0.98, 0.05), (0.98, 0.72)]):
        pressed = fem.press(reduced, finger.bench.specimen(modulus), force=force, fidelity="contact", friction="stick")
        assert found.reading[row, k] == pytest.approx(pressed.reading[3], rel=0.03)
    along, across = found.slopes[3, :4, k], found.slopes[4, :4, k]
    assert np.abs(across).max() < 0.02 * np.abs(along).max()
    row = np.array([g.y_mm == 0 and g.direction_deg == 0 for g in found.gauges])
    unsure = problem(found, scene)
    anywhere, in_a_row = place(unsure, 4), place(unsure, 4, row)
    assert unsure.sigma(anywhere[-1]) < unsure.sigma(in_a_row[-1])


def test_a_name_of_unknowns_says_what_is_unknown():
    for name, (friction, touched) in UNKNOWN_SCENES.items():
        assert (friction, touched) == ("friction" in name, "place" in name)
    assert len(UNKNOWN_SCENES) == 4 and next(iter(UNKNOWN_SCENES.values())) == (True, True)


def test_pictures_show_the_chosen_gauges_and_sigma_by_their_number():
    found = drawn_influence([(3, 0.0, 1), (-3, 2.0, 1), (3, -3.0, 1)])
    turned = replace(found, gauges=(*found.gauges[:2], replace(found.gauges[2], direction_deg=90.0)))
    sigma = {
        layout: {name: [0.9 / (k + n) for k in range(count)] for n, name in enumerate(UNKNOWN_SCENES, start=1)}
        for layout, count in (("anywhere", 3), ("in a row", 2))
    }
    placed = Placed(Finger.default(), turned, [[0], [0, 1], [1, 2]], [[0], [0, 1]], sigma, [])
    (axes,) = places_figure(placed).axes
    sites, *marks = [np.column_stack(line.get_data()) for line in axes.lines]
    assert sites.tolist() == found.sites[:, :2].tolist() and axes.get_aspect() == 1
    half = found.gauges[0].length_mm / 2
    assert marks[0].tolist() == [[-3 - half, 2], [-3 + half, 2]] and marks[2].tolist() == [
        [3, -3 - half],
        [3, -3 + half],
    ]
    (axes,) = sigma_figure(placed).axes
    lines = [np.column_stack(line.get_data()).tolist() for line in axes.lines][:-1]
    expected = [list(map(list, enumerate(sigma[layout][name], start=1)))
                for name in UNKNOWN_SCENES for layout in ("anywhere", "in a row")]  # fmt: skip
    assert lines == expected[: len(lines)] and len(lines) >= 6 and axes.get_ylim()[0] == 0
    assert axes.get_xticks().tolist() == [1, 2, 3]
    styles = {line.get_linestyle() for line in axes.lines[1:-1:2]}, {line.get_linestyle() for line in axes.lines[:-1:2]}
    assert styles == ({"--"}, {"-"})


def test_exchange_starts_from_candidates_of_all_qualities():
    """Also where there are more candidates than starts, each allowed one alone is found."""
    one = made_up(2, k=60)
    for lone in (0, 31, 59):
        among = np.arange(60) == lone
        assert place(one, 2, among) == [[lone]]
