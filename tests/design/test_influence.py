"""Readings of gauges anywhere, and their placement, from made-up touches."""

import csv
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.design import influence, placement
from papilla.design.influence import Influence
from papilla.design.placement import KNOWN, UNKNOWN, Placed, problem
from papilla.design.scene import PRIOR, Scene
from papilla.design.study import read_study
from papilla.estimators.softness.touch import RULES
from papilla.fem.pressing.large_strain import CONTINUED_GAUGE
from papilla.model.finger import Finger, Gauge

FINGER = Finger.default()
QUARTER = [Gauge("a", angle_deg=0.0), Gauge("b", angle_deg=20.0), Gauge("c", angle_deg=20.0, y_mm=5.0),
           Gauge("d", angle_deg=0.0, y_mm=5.0)]  # fmt: skip


def test_readings_and_slopes_of_all_quarters_come_from_touches_of_one():
    """A reading over force of a_k + 2 ln f - 3 ln E + p_k x + q_k y, a tenth less without friction."""
    scene, said = Scene((0.2, 0.8), (0.1, 0.4), forces=2, moduli=2, place_mm=1.5), []
    force, modulus = scene.grid
    a, p, q = np.array([10.0, 20.0, 30.0, 40.0]), np.array([0.0, 1.0, 2.0, 0.0]), np.array([0.0, 0.0, 3.0, 4.0])

    def read(x, y):
        stuck = (2 * np.log(force) - 3 * np.log(modulus))[:, None] + a + p * x + q * y
        return np.array([0.9 * stuck, stuck])

    found = influence._everywhere(QUARTER, FINGER, scene, read, said.append)
    at = [(gauge.angle_deg, gauge.y_mm) for gauge in found.gauges]
    # Those on a plane of symmetry are there once
    assert (
        sorted(at) == sorted([(0, 0), (20, 0), (-20, 0), (20, 5), (-20, 5), (20, -5), (-20, -5), (0, 5), (0, -5)])
        and len(said) == 4
    )
    assert [gauge.name for gauge in found.gauges] == [f"p{k}" for k in range(9)]
    f, e = (part.ravel() for part in np.meshgrid(*scene.points, indexing="ij"))
    assert found.force_N == pytest.approx(np.tile(f, 2)) and found.reading.shape == (8, 9)
    for k, (angle, y) in enumerate(at):
        number = [(0, 0), (20, 0), (20, 5), (0, 5)].index((abs(angle), abs(y)))
        along, across = p[number] * np.sign(angle), q[number] * np.sign(y)
        for rows, place in ((slice(4), 0.0), (slice(4, 8), 1.5)):
            value = a[number] + 2 * np.log(f) - 3 * np.log(e) + (along + across) * place
            assert found.reading[rows, k] == pytest.approx(f * value)
            by_modulus, by_force, free, x, y_slope = found.slopes[:, rows, k]
            assert by_modulus == pytest.approx(-3 * f) and by_force == pytest.approx(f * (value + 2))
            assert free == pytest.approx(-0.1 * f * value)
            assert x == pytest.approx(f * along, abs=1e-9) and y_slope == pytest.approx(f * across, abs=1e-9)
        width, length, height = FINGER.shape.interface
        x, y_place, z = found.sites[k]
        assert (x / width) ** 2 + (y_place / length) ** 2 + (z / height) ** 2 == pytest.approx(1)
        assert y_place == y and np.sign(x) == np.sign(angle)


def test_tractions_are_in_the_order_of_the_grid(monkeypatch):
    scene = Scene((0.2, 0.8), (0.1, 0.4))
    force, modulus = scene.grid

    def grid(reduced, specimens, forces, friction):
        pressed = [(float(one.modulus), f) for one in specimens for f in forces]
        return [(None, SimpleNamespace(traction=np.array([[e, f, friction]]))) for e, f in pressed]

    monkeypatch.setattr(influence, "press_grid", grid)
    said = []
    table = influence._tractions(None, FINGER, scene, 0.25, said.append)
    assert table.shape == (len(force), 1, 3) and said == ["presses of the scene, stuck"]
    assert table[:, 0, 0] == pytest.approx(modulus) and table[:, 0, 1] == pytest.approx(force)
    assert (table[:, 0, 2] == 0.25).all()
    monkeypatch.setattr(influence, "press_grid", lambda *given: [(None, InputError("too deep"))])
    with pytest.raises(InputError, match="leaves what the model covers: too deep"):
        influence._tractions(None, FINGER, scene, 0.0, said.append)
    assert said[-1] == "presses of the scene"


# ---- Placement


def found_at(sites, gauges=None) -> Influence:
    """Readings of k places in two touches, by random numbers."""
    rng, k = np.random.default_rng(4), len(sites)
    gauges = gauges or tuple(Gauge(f"p{n}", angle_deg=float(n), backing_mm=(5.0, 2.0)) for n in range(k))
    return Influence(gauges, np.array(sites, float), rng.normal(0, 900, (2, k)), rng.normal(0, 500, (5, 2, k)),
                     np.array([0.2, 0.8]))  # fmt: skip


def test_a_problem_has_the_doubts_of_its_scene():
    scene = Scene(place_mm=1.5, samples=25)
    doubts = scene.unknown.doubts
    found = found_at([(0, 0, 0), (0, 4.9, 0), (0, 9.9, 0), (0, 14.9, 0)])
    one = problem(found, scene)
    assert one.slopes[1, 2] == pytest.approx([*found.slopes[:, 1, 2], found.reading[1, 2]])
    own = (placement.GAUGE_ERROR**2 + CONTINUED_GAUGE**2 + doubts.gauge_gain**2) * found.reading**2
    own += 25.0 / 25 + (RULES.air_share * doubts.zero_microstrain) ** 2
    assert one.variance == pytest.approx(own)
    # Foils of 5 mm that touch do not overlap
    assert one.overlap[0, 0] and one.overlap[0, 1] and not one.overlap[1, 2]
    for row, force in enumerate((0.2, 0.8)):
        sigma = np.sqrt(1 / np.diag(one.prior[row]))
        offset = (RULES.air_share * doubts.force_offset_N) ** 2 + 0.005**2 / 25
        ln_force = math.sqrt(doubts.force_gain**2 + offset / force**2)
        assert sigma == pytest.approx([PRIOR, ln_force, 0.5, 1.5, 1.5, doubts.creep])
        assert np.count_nonzero(one.prior[row]) == 6
    known = problem(found, scene, friction=False, place=False)
    assert np.sqrt(1 / np.diag(known.prior[0]))[2:5] == pytest.approx([KNOWN] * 3)
    assert known.sigma([0, 2]) <= one.sigma([0, 2])
    direct = np.mean([
        np.linalg.inv(one.prior[p] + sum(np.outer(one.slopes[p, k], one.slopes[p, k]) / one.variance[p, k]
                                         for k in (0, 2)))[0, 0] for p in (0, 1)
    ])  # fmt: skip
    assert one.sigma([0, 2]) == pytest.approx(math.sqrt(direct))


def placed() -> Placed:
    """Two gauges of three places."""
    gauges = (Gauge("p0", angle_deg=10.0), Gauge("p1", angle_deg=-10.0, y_mm=2.0), Gauge("p2", angle_deg=10.0,
              y_mm=-3.0, direction_deg=90.0))  # fmt: skip
    found = found_at([(3.0, 0.0, 1), (-3.0, 2.0, 1), (3.0, -3.0, 1)], gauges)
    sigma = {
        kind: {name: [start / (n + k) for k in range(count)] for n, name in enumerate(UNKNOWN, start=1)}
        for kind, start, count in (("anywhere", 0.6, 3), ("in a row", 0.9, 2))
    }
    return Placed(FINGER, found, [[0], [0, 1], [0, 1, 2]], [[0], [0, 1]], sigma, [])


def test_placed_gauges_are_numbered_along_x_and_then_y():
    one = placed()
    finger = one.of([0, 1, 2])
    assert [(gauge.name, gauge.angle_deg, gauge.y_mm) for gauge in finger.gauges] == [
        ("g1", -10.0, 2.0), ("g2", 10.0, -3.0), ("g3", 10.0, 0.0)
    ]  # fmt: skip
    assert one.sentences == [
        "3 gauges anywhere give sigma 0.2 of ln E (rms over the scene), one 0.6",
        "2 gauges anywhere leave 0.3, 2 in a row at y = 0 leave 0.45",
        "the same 3 gauges with place unknown: 0.15",
        "the same 3 gauges with friction unknown: 0.12",
        "the same 3 gauges with neither: 0.1",
    ]


def test_the_figures_of_a_placement():
    one = placed()
    (axes,) = placement.sigma_figure(one).axes
    lines = {(line.get_label(), line.get_linestyle()): line for line in axes.lines if len(line.get_xdata())}
    first = lines["friction and place unknown", "-"]
    assert list(first.get_xdata()) == [1, 2, 3] and first.get_ydata() == pytest.approx([0.6, 0.3, 0.2])
    dashed = [line for line in axes.lines if line.get_linestyle() == "--" and len(line.get_xdata())]
    assert [line.get_color() for line in dashed] == [lines[name, "-"].get_color() for name in UNKNOWN]
    assert list(dashed[0].get_ydata()) == pytest.approx([0.9, 0.45]) and list(axes.get_xticks()) == [1, 2, 3]
    (axes,) = placement.places_figure(one).axes
    dots, *marks = axes.lines
    assert dots.get_xydata().tolist() == [[3, 0], [-3, 2], [3, -3]]
    half = FINGER.gauges[0].length_mm / 2
    ends = [mark.get_xydata().tolist() for mark in marks[1::2]]
    assert ends == [[[3 - half, 0], [3 + half, 0]], [[-3 - half, 2], [-3 + half, 2]], [[3, -3 - half], [3, -3 + half]]]


def test_gauges_are_placed_in_files(study_file, tmp_path, monkeypatch):
    study = read_study(study_file())
    sites = [(x, y, 10.0) for y in (0.0, 8.0) for x in (-16.0, -8.0, 0.0, 8.0, 16.0)]
    gauges = tuple(Gauge(f"p{k}", angle_deg=3.0 * x, y_mm=y) for k, (x, y, _) in enumerate(sites))
    asked = []
    monkeypatch.setattr(
        placement, "influence", lambda finger, scene, say: asked.append(finger) or found_at(sites, gauges)
    )
    one = placement.place_gauges(study, 3, tmp_path / "out")
    assert asked[0].outer.modulus == pytest.approx(math.sqrt(0.1 * 0.6))
    assert [len(chosen) for chosen in one.sets] == [1, 2, 3] and all(max(chosen) < 5 for chosen in one.rows)
    hardest = problem(one.found, study.scene)
    assert one.sigma["anywhere"]["friction and place unknown"] == [hardest.sigma(chosen) for chosen in one.sets]
    known = problem(one.found, study.scene, friction=False, place=True)
    assert one.sigma["in a row"]["place unknown"] == [known.sigma(chosen) for chosen in one.rows]
    with (tmp_path / "out" / "placement.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["in a row, neither"]) for row in rows] == pytest.approx(one.sigma["in a row"]["neither"])
    assert Finger.load(tmp_path / "out" / "placed_3.toml").gauges == one.of(one.sets[-1]).gauges
    page = (tmp_path / "out" / "placement.html").read_text()
    assert one.sentences[0] in page and page.count("<tr><td>g") == 3
    bad = replace(study, fixed={"gauges.spread_deg": 30.0})
    with pytest.raises(InputError, match=r"--place decides where gauges sit: gauges.spread_deg cannot be fixed"):
        placement.place_gauges(bad, 3, tmp_path)
