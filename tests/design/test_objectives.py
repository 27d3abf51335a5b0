"""Objectives, confirmations and figures of studies against values found by hand."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.calibration.fitting.sweep import DEFAULT_MODULI
from papilla.core.errors import InputError, SolverError
from papilla.design import confirming, job, objectives
from papilla.design.confirming import Confirmed
from papilla.design.in_scene import DesignInScene
from papilla.design.objectives import OBJECTIVES
from papilla.design.parameters import made
from papilla.design.places import Places, foil_of
from papilla.design.results import Effect
from papilla.design.scene import Scene, Tolerances, Unknowns
from papilla.model.finger import Finger

FINGER = Finger.default()


def stub(**parts):
    """A design in a scene of 2 forces and 3 moduli, with stated parts."""
    return SimpleNamespace(
        finger=FINGER, scene=Scene((0.2, 0.8), (0.1, 0.4), forces=2, moduli=3, depth_mm=0.5), **parts
    )


def test_the_force_at_a_depth_is_read_off_a_power_law():
    design = stub()
    force, modulus = design.scene.grid
    # Free presses are deeper, and softer specimens too: only stuck ones on the hardest specimen count
    depth = 0.9 * force**0.7 * np.where(modulus == modulus.max(), 1.0, 3.0)
    design.depths = np.array([2 * depth, depth])
    assert OBJECTIVES["force_at_depth"].of(design) == pytest.approx((0.5 / 0.9) ** (1 / 0.7), rel=1e-3)
    for deep in (0.01, 5.0):
        design.scene = replace(design.scene, depth_mm=deep)
        reached = f"{0.9 * force.min() ** 0.7:.3g} to {0.9 * force.max() ** 0.7:.3g} mm"
        with pytest.raises(InputError, match=f"depth_mm {deep:g} is outside what the forces reach, {reached}"):
            OBJECTIVES["force_at_depth"].of(design)


def test_objectives_of_sigma():
    sigma = np.array([[0.1, 0.2, 0.6], [0.1, 0.2, 0.4]])
    design = stub(sigma_sd=sigma, sigma_gauges=sigma / 2, sigma_depth=sigma / 4)
    assert OBJECTIVES["sigma_sd"].of(design) == 0.6
    assert OBJECTIVES["sigma_gauges"].of(design) == 0.3 and OBJECTIVES["sigma_force_depth"].of(design) == 0.15
    design.scene = replace(design.scene, over="rms")
    assert OBJECTIVES["sigma_sd"].of(design) == pytest.approx(math.sqrt((0.01 + 0.04 + 0.36 + 0.01 + 0.04 + 0.16) / 6))
    assert OBJECTIVES["identifiable_share"].of(design) == pytest.approx(5 / 6)
    design.sigma_gauges = np.full((2, 3), 0.05)
    assert OBJECTIVES["specimens_told_apart"].of(design) == pytest.approx(1 + math.log(4) / (2 * 1.96 * 0.05), rel=1e-3)
    assert [one.sign for one in OBJECTIVES.values()] == [1, -1, 1, 1, 1, 1, -1, -1, 1]
    assert [one.name for one in OBJECTIVES.values()] == [*OBJECTIVES] == sorted(OBJECTIVES)
    assert {name for name, one in OBJECTIVES.items() if one.gauges == 1} == {
        "force_at_depth", "largest_strain", "sigma_force_depth"
    }  # fmt: skip


def test_the_signal_is_the_least_and_noise_shrinks_with_gauges():
    design = stub(sd=np.array([[30.0, 10.0], [20.0, 40.0]]))
    assert OBJECTIVES["signal_over_noise"].of(design) == pytest.approx(10 / (5 / math.sqrt(5)))


def test_the_largest_strain_is_that_of_any_place_under_the_largest_force():
    asked = []

    def end(strain):
        def felt(force, modulus, outer, inner):
            asked.append((*force, *modulus, outer, inner))
            return SimpleNamespace(values=np.array([[[0.01, strain], [9.0, 9.0]]]))

        return SimpleNamespace(felt=felt)

    moduli = FINGER.outer.modulus, FINGER.inner.modulus
    design = stub(geometry=SimpleNamespace(ends=(end(-0.07), end(0.03))), moduli=moduli)
    assert OBJECTIVES["largest_strain"].of(design) == pytest.approx(0.07)
    assert asked == [(0.8, 0.4, *moduli)] * 2


def test_tolerances_give_neighbours_with_one_change_each(monkeypatch, made_up_geometry):
    monkeypatch.setattr(objectives, "geometry_map", made_up_geometry)
    places = Places.row(foil_of(FINGER.gauges))
    geometry = made_up_geometry(FINGER, places)
    limits = Tolerances(gauge_mm=0.3, gauge_deg=3.0, thickness_mm=0.5, moduli=0.25)
    design = DesignInScene(FINGER, geometry, Scene(tolerances=limits))
    found = list(objectives._neighbours(design))
    # In a row gauges cannot turn: twice shifted gauges and two layers, then two skins
    assert len(found) == 8
    moved, outer, inner = (one.finger for one in found[:3])
    steps = [b.angle_deg - a.angle_deg for a, b in zip(FINGER.gauges, moved.gauges, strict=True)]
    assert [np.sign(step) for step in steps] == [1, -1, 1, -1, 1]
    assert steps[2] == pytest.approx(math.degrees(0.3 / FINGER.shape.interface[0]))
    assert outer.outer.modulus == pytest.approx(1.25 * FINGER.outer.modulus) and outer.inner == FINGER.inner
    assert inner.inner.modulus == pytest.approx(1.25 * FINGER.inner.modulus) and inner.outer == FINGER.outer
    back = found[3].finger
    assert [a.angle_deg + b.angle_deg for a, b in zip(moved.gauges, back.gauges, strict=True)] == pytest.approx(
        [2 * gauge.angle_deg for gauge in FINGER.gauges]
    )
    assert found[4].finger.outer.modulus == pytest.approx(FINGER.outer.modulus / 1.25)
    skin = FINGER.shape.outer[-1] - FINGER.shape.interface[-1]
    for one, change in zip(found[6:], (0.5, -0.5), strict=True):
        shape = one.finger.shape
        assert shape.outer[-1] - shape.interface[-1] == pytest.approx(skin + change)
        assert one.geometry.finger.shape == shape
    none = replace(design, scene=Scene(tolerances=Tolerances(0.0, 0.0, 0.0, 0.0)))
    assert list(objectives._neighbours(none)) == []
    turning = replace(design, geometry=replace(geometry, places=Places.whole(foil_of(FINGER.gauges))))
    turned = list(objectives._neighbours(turning))[1].finger
    assert [gauge.direction_deg for gauge in turned.gauges] == [3.0, -3.0, 3.0, -3.0, 3.0]
    worst = OBJECTIVES["worst_over_tolerances"].of(design)
    own = OBJECTIVES["sigma_gauges"].of(design)
    assert worst == max(own, *(OBJECTIVES["sigma_gauges"].of(one) for one in found)) > own


# ---- Confirmations


def test_a_confirmation_says_how_far_off_a_prediction_is():
    ones = np.ones((2, 3))
    one = Confirmed(
        "finger_1.toml", {"S_d": 0.105 * ones, "all gauges": 0.12 * ones},
        {"S_d": 0.1 * ones, "all gauges": 0.1 * ones}, Scene(),
    )  # fmt: skip
    assert one.both("S_d") == (0.105, 0.1)
    assert one.sentence == (
        "finger_1.toml: S_d: predicted 0.105, calibrated 0.1 (within 10 %); "
        "all gauges: predicted 0.12, calibrated 0.1 (off by +20 %)"
    )
    assert replace(one, failed="no mesh").sentence == "finger_1.toml: no calibration: no mesh"


@pytest.mark.parametrize("friction, free", [("unknown", True), ("stick", False), (0, False)])
def test_a_calibration_for_a_confirmation_is_the_usual_one(monkeypatch, friction, free):
    calls, fits, begun = [], [], []
    monkeypatch.setattr(confirming, "begin_large_strain", lambda *given, **how: begun.append(given[1]) or (lambda: ""))
    monkeypatch.setattr(
        confirming.fem, "prepare", lambda finger, **how: (how["size_mm"], how.get("variant", 0), finger.bench.friction)
    )
    monkeypatch.setattr(confirming, "cached_sweep", lambda *given: calls.append(given) or f"sweep {len(calls)}")
    monkeypatch.setattr(confirming, "large_strain_error", lambda reduced, mu: ("error", reduced, mu))
    monkeypatch.setattr(confirming, "fit", lambda *given, **how: fits.append((given, how)) or "calibration")
    finger = made(FINGER, {"shape.scale": 0.5})
    scene = Scene(unknown=replace(Unknowns(), friction=friction))
    assert confirming.calibrated_finger(finger, scene, 1, lambda line: None) == "calibration"
    # A finger of 10 mm instead of 13 gets a finer mesh
    size = 0.7 * 10 / 13
    whole, *others = calls
    assert whole[0] == (pytest.approx(size), 0, None) and whole[1:3] == (DEFAULT_MODULI, scene.swept_N)
    mu = {"unknown": math.inf, "stick": math.inf, 0: 0.0}[friction]
    assert confirming.friction_coefficient(whole[4]) == mu
    assert (others[0][4] == 0.0 and others[0][0] == whole[0]) == free
    scatter = others[free:]
    assert [one[0][1] for one in scatter] == list(confirming.SCATTER_VARIANTS)
    step = confirming.SCATTER_STEP
    assert all(one[1] == DEFAULT_MODULI[::step] and one[2] == scene.swept_N[::step] for one in scatter)
    ((given, how),) = fits
    assert given[0] == "sweep 1" and len(given[1]) == 3 and how["frictionless"] == ("sweep 2" if free else None)
    assert how["friction_known"] == (not free) and how["strain"] == ("error", whole[0], mu)
    assert set(begun[0]) == ({False, True} if free else {mu > 0})


def test_a_failed_calibration_is_a_sentence(monkeypatch):
    def fails(*given):
        raise SolverError("no mesh")

    monkeypatch.setattr(confirming, "calibrated_finger", fails)
    design = SimpleNamespace(sigma_sd=np.ones(1), sigma_gauges=np.ones(1), finger=FINGER, scene=Scene())
    assert confirming.confirm("a", design, 1, lambda line: None).sentence == "a: no calibration: no mesh"
    monkeypatch.setattr(confirming, "calibrated_finger", lambda *given: "calibration")
    monkeypatch.setattr(confirming, "sigma_from_sd", lambda calibration, scene: np.full(1, 2.0))
    monkeypatch.setattr(confirming, "sigma_from_gauges", lambda calibration, scene: np.full(1, 0.95))
    found = confirming.confirm("a", design, 1, lambda line: None)
    assert "S_d: predicted 1, calibrated 2 (off by -50 %)" in found.sentence
    assert "all gauges: predicted 1, calibrated 0.95 (within 10 %)" in found.sentence


# ---- Words and figures of the page


def test_an_effect_in_words():
    one = Effect("outer.modulus_MPa", "sigma_sd", 0.1, 0.6, 0.5, (0.4, 0.7), True)
    assert job.in_words(one) == "outer.modulus_MPa from 0.100 to 0.600 multiplies sigma_sd by 0.500 (0.400 to 0.700)"
    assert "changes sigma_sd by" in job.in_words(replace(one, factor=False)) and one.sure
    assert not replace(one, interval=(0.9, 1.1)).sure and replace(one, factor=False, interval=(0.9, 1.1)).sure
    assert not replace(one, factor=False, interval=(-0.1, 0.1)).sure


def test_the_front_is_marked_in_the_figure():
    found = {"a": np.array([1.0, 2.0, 3.0, 40.0]), "b": np.array([4.0, 3.0, 2.0, 1.0])}
    goals = [SimpleNamespace(name="a", unit="N"), SimpleNamespace(name="b", unit="1")]
    study = SimpleNamespace(objectives=goals, free=[SimpleNamespace(name="x")], finger=SimpleNamespace(name="own"))
    results = SimpleNamespace(
        study=study, values=found.get, free=np.array([[5.0], [6.0], [7.0], [8.0]]), chosen=[0],
        feasible=np.array([True, True, False, True]), front=np.array([True, False, False, True]),
    )  # fmt: skip
    (axes,) = job.front_figure(results, {"a": 9.0, "b": 8.0}).axes
    drawn = {line.get_label(): np.array(line.get_xydata()).tolist() for line in axes.lines}
    assert drawn == {
        "breaks a constraint": [[2.0, 3.0]], "designs": [[4.0, 1.0], [3.0, 2.0], [1.0, 40.0]], "own": [[8.0, 9.0]],
        "Pareto front": [[4.0, 1.0], [1.0, 40.0]], "chosen": [[4.0, 1.0]],
    }  # fmt: skip
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("b", "a (N)")
    assert (axes.get_xscale(), axes.get_yscale()) == ("linear", "log")
    study.objectives = goals[:1]
    (axes,) = job.front_figure(results, {"a": 9.0}).axes
    assert axes.get_xlabel() == "x" and list(axes.lines[1].get_xdata()) == [5.0, 6.0, 8.0]
    assert any(list(line.get_ydata()) == [9.0, 9.0] for line in axes.lines)


def test_a_panel_a_design_has_its_sigma_in_per_cent():
    forces, moduli = np.geomspace(0.2, 0.8, 4), np.geomspace(0.1, 0.4, 3)
    sigma = 0.01 * np.outer(np.ones(4), [1.0, 3.0, 30.0])
    left, right, bar = job.sigma_figure(forces, moduli, [("one", sigma), ("two", 1e-9 + 0 * sigma)]).axes
    assert (left.get_title(loc="left"), right.get_title(loc="left")) == ("one", "two")
    assert left.get_xscale() == left.get_yscale() == "log" and left.get_xlim() == pytest.approx((0.2, 0.8))
    assert [text.get_text() for text in left.get_xticklabels()] == ["0.2", "0.4", "0.8"]
    assert [text.get_text() for text in bar.get_yticklabels()] == [f"{one} %" for one in job.LEVELS]
    levels = left.collections[0].levels if hasattr(left.collections[0], "levels") else None
    assert levels is None or 10**levels == pytest.approx(job.LEVELS)
