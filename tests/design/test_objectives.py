"""Objectives of a design: limits, scaling, symmetry and order, on a made-up geometry of real responses."""

import math
from dataclasses import replace

import numpy as np
import pytest
from made_up_geometry import made_up_map

from papilla.calibration import DEFAULT_MODULI
from papilla.core.errors import InputError
from papilla.design import OBJECTIVES_BY_NAME, DesignScene
from papilla.design.calibrated import calibration_errors
from papilla.design.geometry import gains_of, with_sites
from papilla.design.in_scene import DesignInScene
from papilla.design.parameters import made
from papilla.design.places import Places, foil_of, moved
from papilla.design.scene import Tolerances
from papilla.fem.reduction.family import MODULUS_RATIO_ENDS
from papilla.model.finger import Finger

FINGER = Finger.default()
SCENE = DesignScene(forces=2, moduli=3, samples=20)
SIGMAS = ("sigma_sd", "sigma_gauges", "sigma_force_depth")


@pytest.fixture(scope="module")
def design():
    """design(finger, scene, places) : a finger on the made-up geometry."""

    def make(finger=FINGER, scene=SCENE, places=None):
        places = places or Places.of(FINGER)
        return DesignInScene(finger, made_up_map(with_sites(finger, places), places), scene)

    return make


def of(name, one):
    return OBJECTIVES_BY_NAME[name].of(one)


def gained(factors):
    """The finger with other gains of its gauges."""
    gauges = [
        replace(one, membrane_gain=factor * one.membrane_gain, lever_mm=factor * one.lever_mm)
        for one, factor in zip(FINGER.gauges, factors, strict=True)
    ]
    return replace(FINGER, gauges=tuple(gauges))


@pytest.mark.parametrize("factor", [0.1, 3.0])
def test_a_gain_is_a_gain_of_the_signal_alone(design, factor):
    plain, loud = design(), design(gained([factor] * 5))
    assert of("signal_over_noise", loud) == pytest.approx(factor * of("signal_over_noise", plain))
    for name in ("largest_strain", "sigma_force_depth"):
        assert of(name, loud) == pytest.approx(of(name, plain))
    assert (of("sigma_sd", loud) < of("sigma_sd", plain)) == (factor > 1)
    halved = design(scene=replace(SCENE, gauge_noise_microstrain=SCENE.gauge_noise_microstrain / 2))
    assert of("signal_over_noise", halved) == pytest.approx(2 * of("signal_over_noise", plain))


@pytest.mark.parametrize("factor", [0.5, 1.7])
def test_moduli_and_forces_scale_together(design, factor):
    """All moduli and all forces times a factor: the same strains."""
    finger = made(
        FINGER, {f"{name}.modulus_MPa": factor * getattr(FINGER, name).modulus for name in ("outer", "inner")}
    )
    scene = replace(SCENE, force_N=tuple(factor * f for f in SCENE.force_N),
                    modulus_MPa=tuple(factor * e for e in SCENE.modulus_MPa))  # fmt: skip
    one, other = design(), design(finger, scene)
    assert of("largest_strain", other) == pytest.approx(of("largest_strain", one))
    assert of("signal_over_noise", other) == pytest.approx(of("signal_over_noise", one))
    np.testing.assert_allclose(other.readings, one.readings, rtol=1e-9)
    np.testing.assert_allclose(other.depths, one.depths, rtol=1e-9)


def test_readings_are_gain_times_strain_plus_lever_times_curvature(design):
    one = design(gained([1.0, -0.5, 0.3, 2.0, 1.0]))
    force, modulus = SCENE.grid
    gains = gains_of(one.finger)
    assert gains.shape == (2, 5) and gains[1, 2] == one.finger.gauges[2].lever_mm
    for end, readings in zip(one.ends, one.readings, strict=True):
        strain, curvature = np.moveaxis(end.felt(force, modulus, *one.moduli).values, 1, 0)
        np.testing.assert_allclose(readings, 1e6 * (gains[0] * strain + gains[1] * curvature), rtol=1e-9)


def test_errors_of_a_calibration_are_shares_of_its_sweep(design):
    """Without tables 1.8 % of a reading for large strain, and 0.25 % of its membrane strain for meshes."""
    finger = gained([1.0] * 5)
    bent = replace(finger, gauges=tuple(replace(gauge, membrane_gain=0.0, lever_mm=1.0) for gauge in finger.gauges))
    thin = replace(finger, gauges=tuple(replace(gauge, lever_mm=0.0) for gauge in finger.gauges))
    force, modulus = map(np.ravel, np.meshgrid(SCENE.swept(Finger.default())[0][::6], DEFAULT_MODULI[::3]))
    for one, share in ((design(bent), 0.018), (design(thin), math.hypot(0.018, 0.0025))):
        end = one.ends[1]
        valid = end.inside(force, modulus, *one.moduli) & (modulus >= one.softest_MPa)
        felt = end.felt(force[valid], modulus[valid], *one.moduli).values
        reading = 1e6 * (felt * gains_of(one.finger)).sum(axis=1) / force[valid][:, None]
        assert calibration_errors(one)[1] == pytest.approx(share * np.sqrt((reading**2).mean(axis=0)), rel=1e-6)


def test_more_doubt_never_tells_more(design):
    """Noise, unknown friction and the worst case against the mean square."""
    plain = {name: of(name, design()) for name in SIGMAS}
    for changes in ({"gauge_noise_microstrain": 500.0}, {"force_noise_N": 0.1}, {"depth_noise_mm": 0.1}):
        for name in SIGMAS:
            assert of(name, design(scene=replace(SCENE, **changes))) >= plain[name] * (1 - 1e-9)
    known = replace(SCENE, unknown=replace(SCENE.unknown, friction="stick"))
    rms = replace(SCENE, over="rms")
    for name in SIGMAS:
        assert of(name, design(scene=known)) <= plain[name] * (1 + 0.02)
        assert of(name, design(scene=rms)) <= plain[name]
    assert of("sigma_gauges", design(scene=replace(SCENE, force_noise_N=0.1))) > plain["sigma_gauges"]


def test_what_follows_from_sigma(design):
    one = design()
    assert of("identifiable_share", one) == np.mean(one.sigma_sd < 0.5)
    assert of("sigma_sd", one) == one.sigma_sd.max() and of("sigma_gauges", one) == one.sigma_gauges.max()
    mean = np.sqrt((one.sigma_gauges**2).mean(axis=0))
    apart = 1 + np.trapezoid(1 / (2 * 1.96 * mean), np.log(SCENE.points[1]))
    assert of("specimens_told_apart", one) == pytest.approx(apart, rel=1e-4)
    assert of("signal_over_noise", one) == pytest.approx(one.sd.min() / (SCENE.gauge_noise_microstrain / math.sqrt(5)))


def test_the_force_at_a_depth_makes_that_depth(design):
    force, modulus = SCENE.grid
    hardest = modulus == modulus.max()
    depth = design().depths[1][hardest]
    for share in (0.1, 0.5, 0.9):
        scene = replace(SCENE, depth_mm=depth[0] * (depth[-1] / depth[0]) ** share)
        found = of("force_at_depth", design(scene=scene))
        assert np.exp(np.interp(np.log(found), np.log(force[hardest]), np.log(depth))) == pytest.approx(scene.depth_mm)
    for deep in (0.9 * depth[0], 1.1 * depth[-1]):
        with pytest.raises(InputError, match=f"depth_mm {deep:g} is outside what the forces reach"):
            of("force_at_depth", design(scene=replace(SCENE, depth_mm=deep)))


def test_a_geometry_covers_a_range_of_ratios_and_its_gauges_are_sums_of_sites(design):
    places = Places.row(foil_of(FINGER.gauges))
    geometry = design(places=places).geometry
    low, high = MODULUS_RATIO_ENDS
    for ratio in (low, high):
        free, stuck = geometry.of(made(FINGER, {"outer.modulus_MPa": ratio * 0.1, "inner.modulus_MPa": 0.1}))
        assert (free.gauge_count, free.friction, stuck.friction) == (5, 0.0, math.inf)
    for ratio in (0.99 * low, 1.01 * high):
        with pytest.raises(InputError, match=f"is {ratio:.3g}: a study covers {low:g} to {high:g}"):
            geometry.of(made(FINGER, {"outer.modulus_MPa": ratio * 0.1, "inner.modulus_MPa": 0.1}))
    # Gauges between sites feel what their neighbours feel, smoothly
    felt = [
        geometry.of(made(FINGER, {"gauges.spread_deg": spread}))[1].felt(
            np.array([0.5]), np.array([0.3]), FINGER.outer.modulus, FINGER.inner.modulus).values[0, 0, -1]
        for spread in (32.0, 34.0, 36.0, 38.0, 40.0)
    ]  # fmt: skip
    assert np.abs(np.diff(felt, 2)).max() < 0.3 * np.abs(np.diff(felt)).max()


def test_the_largest_strain_is_that_of_the_largest_force_on_the_hardest_specimen(design):
    """Of all places, stuck or without friction, and without curvature."""
    one = design(places=Places.row(foil_of(FINGER.gauges)))
    force, modulus = np.array([SCENE.force_N[1]]), np.array([SCENE.modulus_MPa[1]])
    strains = [end.felt(force, modulus, *one.moduli).values[0, 0] for end in one.geometry.ends]
    assert len(strains[0]) == 17 and of("largest_strain", one) == max(np.abs(strain).max() for strain in strains)


@pytest.mark.parametrize("count, limits", [(4, Tolerances(2.0, 0.0, 0.0, 0.0)), (5, Tolerances(0.0, 0.0, 0.0, 0.4)),
                                           (4, Tolerances(1.0, 0.0, 0.0, 0.2))])  # fmt: skip
def test_the_worst_is_of_neighbours_with_one_tolerance_at_its_limit(design, count, limits):
    """Gauges go to and fro along the interface in turn; a layer is harder or softer by the factor 1 + limit."""
    finger = made(FINGER, {"gauges.count": count})
    one = design(finger, replace(SCENE, over="rms", tolerances=limits), Places.row(foil_of(FINGER.gauges)))
    neighbours = []
    for side in (1, -1):
        shifted = [moved(gauge, FINGER.shape, side * (-1) ** k * limits.gauge_mm)
                   for k, gauge in enumerate(finger.gauges)]  # fmt: skip
        neighbours.append(replace(finger, gauges=tuple(shifted)))
        for name in ("outer", "inner"):
            modulus = getattr(FINGER, name).modulus * (1 + limits.moduli) ** side
            neighbours.append(made(finger, {f"{name}.modulus_MPa": modulus}))
    sigmas = [np.sqrt(np.mean(replace(one, finger=near).sigma_gauges ** 2)) for near in (finger, *neighbours)]
    assert of("worst_over_tolerances", one) == pytest.approx(max(sigmas), rel=1e-9) and max(sigmas) > sigmas[0]


def test_turned_gauges_are_neighbours_where_a_study_has_turned_places(design):
    turn = replace(SCENE, tolerances=Tolerances(0.0, 40.0, 0.0, 0.0))
    row, whole = (design(scene=turn, places=places(foil_of(FINGER.gauges))) for places in (Places.row, Places.whole))
    assert of("worst_over_tolerances", row) == of("sigma_gauges", row)
    sigmas = [
        replace(whole, finger=replace(FINGER, gauges=tuple(
            moved(gauge, FINGER.shape, 0.0, sign * 40.0 * (-1) ** k) for k, gauge in enumerate(FINGER.gauges)
        ))).sigma_gauges.max()
        for sign in (1, -1)
    ]  # fmt: skip
    assert of("worst_over_tolerances", whole) == pytest.approx(max(*sigmas, whole.sigma_gauges.max()), rel=1e-9)
