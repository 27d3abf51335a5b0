"""Parameters, ranges, samples and places of studies, each against values found by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.design import sampling
from papilla.design.geometry import GeometryMap, measure_base, with_sites
from papilla.design.in_scene import DesignInScene
from papilla.design.parameters import made, parameters_of
from papilla.design.places import Places, angle_of, foil_of, half_length, moved
from papilla.design.scene import DesignScene
from papilla.design.study import Free, probes, read_study
from papilla.fem.pressing.large_strain import known
from papilla.model.finger import Finger, Gauge, Layer, Ridges, Slab

FINGER = Finger.default()
SHAPE, FOIL = FINGER.shape, foil_of(FINGER.gauges)


def test_a_row_of_gauges_keeps_its_spread_and_a_spread_its_row():
    seven = made(FINGER, {"gauges.count": 7})
    spread = max(gauge.angle_deg for gauge in FINGER.gauges)
    assert [gauge.angle_deg for gauge in seven.gauges] == pytest.approx(np.linspace(-spread, spread, 7))
    assert [gauge.name for gauge in seven.gauges] == [f"g{k}" for k in range(1, 8)]
    assert [gauge.angle_deg for gauge in made(FINGER, {"gauges.count": 1}).gauges] == [0.0]
    wide = made(FINGER, {"gauges.spread_deg": 50.0, "gauges.count": 3})
    assert [gauge.angle_deg for gauge in wide.gauges] == [-50.0, 0.0, 50.0]
    assert len(made(FINGER, {"gauges.count": 16}).gauges) == 16
    for count in (0, 17, 2.5):
        with pytest.raises(InputError, match="whole number from 1 to 16"):
            made(FINGER, {"gauges.count": count})


def test_values_of_gauges_and_layers():
    finger = made(FINGER, {"gauges.lever_mm": -0.5, "gauges.g2.membrane_gain": 1.5, "gauges.g4.angle_deg": 33.0,
                           "inner.nu": 0.3, "outer.modulus_MPa": 0.7})  # fmt: skip
    assert {gauge.lever_mm for gauge in finger.gauges} == {-0.5}
    assert [gauge.membrane_gain == 1.5 for gauge in finger.gauges] == [False, True, False, False, False]
    assert finger.gauges[3].angle_deg == 33.0 and finger.gauges[2] == replace(FINGER.gauges[2], lever_mm=-0.5)
    assert (finger.inner.nu, finger.outer.modulus, finger.inner.modulus) == (0.3, 0.7, FINGER.inner.modulus)
    with pytest.raises(InputError, match="inner.nu = 0.6: "):
        made(FINGER, {"inner.nu": 0.6})


def test_a_scale_is_for_everything_but_gauges():
    half = made(replace(FINGER, gauges=(replace(FINGER.gauges[0], y_mm=4.0), *FINGER.gauges[1:])), {"shape.scale": 0.5})
    for surface in ("outer", "interface", "bone"):
        assert getattr(half.shape, surface) == pytest.approx(np.array(getattr(FINGER.shape, surface)) / 2)
    assert half.patch_radius == FINGER.patch_radius / 2 and half.gauges[0].y_mm == 2.0
    assert half.gauges[0].length_mm == FINGER.gauges[0].length_mm
    thick = made(FINGER, {"shape.skin_mm": 5.0, "shape.outer.x_mm": 30.0, "shape.interface.y_mm": 22.0})
    assert thick.shape.outer == (30.0, *FINGER.shape.outer[1:])
    assert thick.shape.interface == (25.0, 22.0, FINGER.shape.outer[2] - 5.0)


def test_layers_may_move_together_but_not_cross():
    smaller = made(FINGER, {"shape.outer.z_mm": 16.0, "shape.skin_mm": 2.0})
    assert smaller.shape.outer == (24, 30, 16) and smaller.shape.interface == (22, 28, 14)
    with pytest.raises(InputError, match="thicker"):
        made(FINGER, {"shape.skin_mm": 14.0})
    with pytest.raises(InputError, match="surface files"):
        parameters_of(Finger.load("papilla/data/surfaces_finger.toml"))


def test_a_row_is_of_the_first_gauge_and_ridges_grow_with_the_body():
    gauges = tuple(replace(one, lever_mm=0.1 * k, y_mm=1.0) for k, one in enumerate(FINGER.gauges, start=1))
    row = made(replace(FINGER, gauges=gauges), {"gauges.count": 3}).gauges
    assert [(one.lever_mm, one.y_mm, one.direction_deg) for one in row] == [(0.1, 0.0, 0.0)] * 3
    ridged = made(replace(FINGER, ridges=Ridges(1.2, 0.4, 0.2)), {"shape.scale": 0.5})
    assert ridged.ridges == Ridges(0.6, 0.2, 0.1)


def test_a_range_is_even_or_even_in_the_logarithm():
    even, log = Free("a", 10.0, 30.0, False, 5), Free("b", 0.1, 10.0, True, 3)
    some = Free("c", 1.0, 4.0, False, 3, (4.0, 1.0, 2.0))
    assert even.at(0.25) == 15.0 and even.share(25.0) == 0.75 and even.grid == [10, 15, 20, 25, 30]
    assert log.at(0.5) == pytest.approx(1.0) and log.share(1.0) == pytest.approx(0.5)
    assert log.grid == pytest.approx([0.1, 1.0, 10.0])
    assert [some.at(u) for u in (0.0, 0.32, 0.34, 0.99, 1.0)] == [4.0, 4.0, 1.0, 2.0, 2.0] and some.grid == [4, 1, 2]
    assert some.share(2.0) == pytest.approx(1 / 3) and Free("d", 2.0, 2.0, False, 1, (2.0,)).share(2.0) == 0.0


def test_what_a_study_file_leaves_out(study_file):
    study = read_study(study_file())
    modulus, spread = study.free
    assert (modulus.log, spread.log, modulus.levels) == (True, False, 5)
    assert study.scene.unknown.doubts.thickness_mm == FINGER.bench.thickness
    assert study.asked == ("sigma_sd", "signal_over_noise") and study.store is None and study.confirm == 0
    middle, *ends = probes(study)
    assert middle == {"outer.modulus_MPa": pytest.approx(math.sqrt(0.06)), "gauges.spread_deg": 35.0}
    assert [end["gauges.spread_deg"] for end in ends] == [35.0, 35.0, 20.0, 50.0]
    assert [end["outer.modulus_MPa"] for end in ends[:2]] == pytest.approx([0.1, 0.6])


def test_a_study_needs_the_places_that_it_varies(study_file):
    own = read_study(study_file(own=True))
    assert [round(angle) for angle, _, _ in own.places.own] == [-40, -20, 0, 20, 40]
    row = read_study(study_file())
    assert row.places == Places.row(FOIL)
    turned = read_study(study_file(("[couplings]", '"gauges.g1.direction_deg" = [0.0, 90.0]\n[couplings]')))
    assert turned.places == Places.whole(FOIL)
    tolerant = read_study(study_file(('"sigma_sd"', '"worst_over_tolerances"'), own=True))
    assert tolerant.places == row.places
    coupled = read_study(study_file(("[couplings]", '"shape.skin_mm" = [2.0, 4.0]\n[couplings]\n"shape.bone.z_mm" = '
                                     '"6 + 0 * outer.modulus_MPa"')))  # fmt: skip
    assert [one.name for one in coupled.outer] == ["outer.modulus_MPa", "shape.skin_mm"]


def test_as_many_designs_as_asked_in_as_many_geometries(study_file):
    shaped = ('"gauges.spread_deg" = { low = 20.0, high = 50.0 }', '"shape.skin_mm" = [2.0, 4.0]')
    study = read_study(study_file(shaped, ("designs = 12", "designs = 11\ngeometries = 3")))
    groups = list(sampling.groups(study))
    assert [len(group) for group in groups] == [4, 4, 3] and sampling.count(study) == (11, 3)
    grid = replace(study, sampler=replace(study.sampler, kind="grid"))
    assert sampling.count(grid) == (25, 5) and [len(group) for group in sampling.groups(grid)] == [5] * 5
    best = replace(study, sampler=replace(study.sampler, kind="optimise"))
    assert sampling.count(best) == (11, 11)
    flat = replace(best, free=(replace(best.free[0], name="outer.modulus_MPa"),))
    assert sampling.count(flat) == (11, 1)


def test_an_optimiser_asks_for_whole_generations_within_the_ranges(study_file):
    study = read_study(study_file(("designs = 12", 'kind = "optimise"\ndesigns = 64')))
    asked = []

    def score(designs):
        asked.append(len(designs))
        assert all(0.1 <= one["outer.modulus_MPa"] <= 0.6 and 20 <= one["gauges.spread_deg"] <= 50 for one in designs)
        return [(one["gauges.spread_deg"] - 31.0) ** 2 for one in designs]

    sampling.optimised(study, score)
    assert set(asked) == {8} and sum(asked) == 64
    asked.clear()
    sampling.optimised(replace(study, sampler=replace(study.sampler, designs=4)), score)
    assert asked[0] == 5 and len(asked) == 2


def test_places_of_a_dome_and_a_slab():
    slab = Slab(outer=(20.0, 20.0), interface=(17.0, 17.0), bone=(8.0, 6.0), depth=50.0)
    a, b, _ = SHAPE.interface
    assert half_length(SHAPE) == b and half_length(slab) == 25.0
    narrow = a * math.sqrt(1 - (5.0 / b) ** 2)
    assert angle_of(Gauge("g", x_mm=narrow / 2, y_mm=5.0), SHAPE) == pytest.approx(30.0)
    assert angle_of(Gauge("g", x_mm=8.5, y_mm=5.0), slab) == pytest.approx(30.0)
    turned = moved(Gauge("g", angle_deg=10.0, direction_deg=5.0), SHAPE, -0.2, 3.0)
    assert turned.direction_deg == 8.0 and turned.angle_deg < 10.0
    whole = Places.whole(FOIL)
    assert whole.angles[-1] == 64.0 and whole.shares[-1] == pytest.approx(0.6) and whole.directions == (0, 45, 90)
    sites = whole.gauges(SHAPE)
    assert len(sites) == 17 * 9 * 3 and sites[4].y_mm == pytest.approx(0.075 * b) and sites[4].direction_deg == 45.0


@pytest.mark.parametrize(
    "places, gauge, message",
    [
        (Places.row, {"angle_deg": 70.0}, "outside the places"),
        (Places.row, {"angle_deg": 7.0, "direction_deg": 30.0}, "turned"),
        (Places.whole, {"angle_deg": 0.0, "y_mm": 17.1}, "64 degrees and 16.2 mm of y"),
    ],
)
def test_gauges_outside_and_turned_ones_in_a_row_are_refused(places, gauge, message):
    with pytest.raises(InputError, match=message):
        places(FOIL).weights([Gauge("g", **gauge)], SHAPE)


def test_gauges_of_a_study_have_one_foil_and_are_not_moved():
    one = FINGER.gauges[0]
    for changes, message in (({"length_mm": 1.0}, "one length_mm"), ({"moved_mm": (0.1, 0.0)}, "moved")):
        with pytest.raises(InputError, match=message):
            foil_of([replace(one, **changes), FINGER.gauges[1]])


def tensor_field(gauge: Gauge) -> float:
    """Strain along a gauge of a symmetric tensor field with the mirrors of a press at the apex."""
    a, s, turn = math.radians(gauge.angle_deg), gauge.y_mm / half_length(SHAPE), math.radians(gauge.direction_deg)
    xx, yy, xy = math.cos(3 * a) + s * s, math.cos(2 * a) - s**2, 0.3 * math.sin(2 * a) * math.sin(2 * s)
    c, s = math.cos(turn), math.sin(turn)
    return c * c * xx + s * s * yy + 2 * s * c * xy


@pytest.mark.parametrize(
    "angle, y, turn", [(11.0, 3.3, 20.0), (-37.0, 3.3, 20.0), (5.0, -9.0, 90.0), (-22.0, -14.0, -50.0)]
)
def test_a_gauge_is_a_sum_of_sites_in_every_quadrant_and_direction(angle, y, turn):
    places, gauge = Places.whole(FOIL), Gauge("g", angle_deg=angle, y_mm=y, direction_deg=turn)
    felt = np.array([tensor_field(site) for site in places.gauges(SHAPE)])
    assert felt @ places.weights([gauge], SHAPE) == pytest.approx([tensor_field(gauge)], abs=2e-4)


def test_a_gauge_moves_by_millimetres():
    for angle in (0.0, 40.0):
        there = moved(Gauge("g", angle_deg=angle), SHAPE, 0.1).angle_deg
        t, (a, _, c) = np.radians([angle, there]), SHAPE.interface
        assert math.hypot(a * np.ptp(np.sin(t)), c * np.ptp(np.cos(t))) == pytest.approx(0.1, rel=1e-2)


def test_a_finger_a_third_as_large_has_the_large_strain_of_the_FINGER(tmp_path, monkeypatch):
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path))
    small = made(FINGER, {"shape.scale": 1 / 3})
    foil = {"length_mm": 0.8, "width_mm": 2 / 3, "backing_mm": (1.6, 2 / 3)}
    small = replace(small, gauges=tuple(replace(one, **foil) for one in small.gauges))
    base = with_sites(small, Places.of(small))
    assert not known(base.strain_sha256)
    assert measure_base(base, 1, pytest.fail) == ""
    found, shipped = (known(one.strain_sha256) for one in (base, FINGER))
    assert shipped
    for one, other in zip(found, shipped, strict=True):
        assert one.force == pytest.approx(other.force / 9) and one.modulus == pytest.approx(other.modulus)
        gauges = len(FINGER.gauges)
        strain, curvature = np.split(one.finite[:, 3:] / other.finite[:, 3:], [gauges], axis=1)
        assert strain == pytest.approx(1.0) and curvature == pytest.approx(3.0)


@pytest.mark.parametrize(
    "inner, softest, begins", [(0.034, 0.015, "begins at 0.01"), (0.4, 0.019, "begins at 0.2"), (20.0, 0.019, "has no")]
)
def test_a_specimen_below_the_first_modulus_of_a_calibration_is_refused(made_up_geometry, inner, softest, begins):
    finger, places = FINGER, Places.of(FINGER)
    free, stuck = made_up_geometry(with_sites(finger, places), places).ends
    measured = GeometryMap(finger, places, (replace(free, large_strain=True), replace(stuck, large_strain=True)))
    stiff = replace(finger, inner=Layer(inner), outer=Layer(4 * inner))
    with pytest.raises(InputError, match=f"too soft for an inner layer of {inner:.3g} MPa.* a calibration {begins}"):
        _ = DesignInScene(stiff, measured, DesignScene(modulus_MPa=(softest, 0.72))).ends
