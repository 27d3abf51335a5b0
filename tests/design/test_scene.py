"""Expected sigma of ln E against the closed form of a linear Gaussian model, and errors of a design's calibration."""

import math
from dataclasses import replace

import numpy as np
import pytest

from papilla.calibration import GaugeSurface, SdSurface, Uncertainty
from papilla.calibration.fitting.surface_fit import usable_part
from papilla.design.calibrated import DesignSurfaces, calibration_errors, depth_surface
from papilla.design.geometry import GeometryMap, gains_of, with_sites
from papilla.design.in_scene import DesignInScene
from papilla.design.places import Places
from papilla.design.scene import DesignScene, Unknowns, sigma_from_depth, sigma_from_gauges, sigma_from_sd
from papilla.estimators.softness import Doubts
from papilla.estimators.softness.touch import TOUCH_RULES
from papilla.fem.pressing.large_strain import at_ratio, error_of_tables, known
from papilla.model.finger import Finger

FINGER = Finger.default()
POWERS = (-0.5, 0.3)
CERTAIN = DesignScene((0.2, 0.8), (0.1, 0.4), forces=2, moduli=3, samples=25, unknown=Unknowns("stick", Doubts.NONE))


def surface(scene, values):
    """The surface of values of the presses of the scene's grid, without an error."""
    return scene.solver.surface(values).surface, Uncertainty(0.0, 0.0, 0.0, np.array(scene.force_N), np.zeros(2), 0.0,
                                                             0, strain=0.0)  # fmt: skip


def gauges_of(scene, powers=POWERS):
    """Gauges that read 1000 force E^p microstrain."""
    moduli = scene.grid[1]
    return DesignSurfaces([GaugeSurface(f"g{p}", *surface(scene, 1000 * moduli**p)) for p in powers])


def sigma_of(scene, readings, noise, zero, powers):
    """Of ln E with a prior of 1: n readings f E^p and the force, whose errors are independent, and a prior of 0.5 of ln
    force."""
    by_modulus = np.array([p * reading for p, reading in zip(powers, readings, strict=True)])
    force = scene.points[0][:, None]
    weight, samples = 1 / (noise**2 / scene.samples + zero**2), scene.samples
    offset = TOUCH_RULES.air_share * scene.unknown.doubts.force_offset_N
    of_force = (force / np.sqrt(scene.force_noise_N**2 / samples + offset**2)) ** 2 + 0.5**-2
    aa, bb = weight * (by_modulus**2).sum(axis=0), weight * (readings**2).sum(axis=0) + of_force
    ab = weight * (by_modulus * readings).sum(axis=0)
    return 1 / np.sqrt(1 + aa - ab**2 / bb)


@pytest.mark.parametrize("seed", range(6))
def test_sigma_of_readings_that_are_powers_has_a_closed_form(seed):
    rng = np.random.default_rng(seed)
    doubts = replace(Doubts.NONE, zero_microstrain=rng.uniform(0, 200), force_offset_N=rng.uniform(0, 0.02))
    scene = replace(CERTAIN, gauge_noise_microstrain=rng.uniform(20, 300), force_noise_N=rng.uniform(0.005, 0.05),
                    depth_noise_mm=rng.uniform(0.005, 0.02), depth_zero_mm=rng.uniform(0.002, 0.05),
                    unknown=Unknowns("stick", doubts))  # fmt: skip
    force, modulus = np.meshgrid(*scene.points, indexing="ij")
    readings = np.array([1000 * force * modulus**p for p in POWERS])
    zero, noise = TOUCH_RULES.air_share * doubts.zero_microstrain, scene.gauge_noise_microstrain
    expected = sigma_of(scene, readings, noise, zero, POWERS)
    assert sigma_from_gauges(gauges_of(scene), scene) == pytest.approx(expected, rel=1e-3)
    # Depth in micrometres, without the doubts of gauges: its own zero is not measured in the air
    depth = DesignSurfaces([GaugeSurface("depth", *surface(scene, 400 * scene.grid[1] ** -0.6))])
    readings = 400 * force * modulus**-0.6
    expected = sigma_of(scene, readings[None], 1e3 * scene.depth_noise_mm, 1e3 * scene.depth_zero_mm, (-0.6,))
    assert sigma_from_depth(depth, scene) == pytest.approx(expected, rel=1e-3)
    # S_d is the mean of four gauges
    fitted, certain = surface(scene, np.log(500 * scene.grid[0] * scene.grid[1] ** 0.4))
    sd = DesignSurfaces(gauges_of(scene, POWERS * 2).gauges, SdSurface(fitted, *usable_part(fitted), certain))
    expected = sigma_of(scene, (500 * force * modulus**0.4)[None], noise / 2, zero / 2, (0.4,))
    assert sigma_from_sd(sd, scene) == pytest.approx(expected, rel=1e-3)


def test_where_nothing_is_told_the_prior_is_left():
    """S_d that falls with the modulus, or a modulus beyond those of the surfaces."""
    for power, all_lost in ((-0.4, True), (0.4, False)):
        fitted, certain = surface(CERTAIN, np.log(500 * CERTAIN.grid[0] * CERTAIN.grid[1] ** power))
        sd = DesignSurfaces(gauges_of(CERTAIN).gauges, SdSurface(fitted, *usable_part(fitted), certain))
        sigma = sigma_from_sd(sd, CERTAIN)
        assert sigma.shape == (2, 3) and ((sigma == 1).all() if all_lost else (sigma < 1).all())
    wide = replace(CERTAIN, modulus_MPa=(0.01, 4.0))
    sigma = sigma_from_gauges(gauges_of(CERTAIN), wide)
    assert (sigma[:, [0, 2]] == 1).all() and (sigma[:, 1] < 0.1).all()


@pytest.fixture(scope="module")
def strained():
    """strained(factor, most_N, friction) : the default finger with its moduli times a factor, with large strain, in a
    scene."""
    from made_up_geometry import made_up_map

    places = Places.of(FINGER)
    free, stuck = made_up_map(with_sites(FINGER, places), places).ends

    def make(factor=1.0, most_N=0.98, friction="unknown"):
        layers = {
            name: replace(getattr(FINGER, name), modulus=factor * getattr(FINGER, name).modulus)
            for name in ("outer", "inner")
        }
        ends = replace(free, large_strain=True), replace(stuck, large_strain=True)
        scene = DesignScene((0.05, most_N), (0.2, 0.72), unknown=Unknowns(friction))
        return DesignInScene(replace(FINGER, **layers), GeometryMap(FINGER, places, ends), scene)

    return make


@pytest.mark.parametrize("factor, most_N, friction", [(1.0, 0.98, "unknown"), (0.3, 0.98, 0), (6.0, 0.5, "stick")])
def test_errors_of_a_calibration_with_large_strain(strained, factor, most_N, friction):
    """The tables' own error; 2.6 % of S_d and 3 % of a gauge for presses beyond their forces, 0.9 to 36 mm2 of the
    inner modulus, by up to 2.25 times; and 0.25 % of the membrane strain for meshes."""
    design, stuck = strained(factor, most_N, friction), friction != 0
    outer, inner = design.moduli
    swept, moduli = map(np.array, design.scene.swept(design.finger))
    area = swept / inner
    swept = swept[(area >= 0.9 / 2.25) & (area <= 36 * 2.25)]
    lost = np.mean((swept / inner < 0.9 * math.exp(-0.05)) | (swept / inner > 36 * math.exp(0.05)))
    force, modulus = (axis.ravel() for axis in np.meshgrid(swept[::6], moduli[::3]))
    end = design.ends[stuck]
    valid = (modulus >= 0.5 * inner) & end.inside(force, modulus, outer, inner)
    gains = gains_of(design.finger)
    felt = 1e6 * end.felt(force[valid], modulus[valid], outer, inner).values * gains / force[valid][:, None, None]
    readings, membrane = felt.sum(axis=1), felt[:, 0]
    tables = [one for one, _ in at_ratio(known(FINGER.strain_sha256), outer / inner, stuck)]
    table = error_of_tables(tables, gains, stuck)
    assert table >= max(one.sd_error(gains) for one in tables)
    step = 1e-6
    moved = [
        (readings + step * membrane * (np.arange(5) == k)).std(axis=1) / readings.std(axis=1) - 1 for k in range(5)
    ]
    by_meshes = 0.0025 * math.sqrt(np.mean(np.sum(np.square(moved), axis=0))) / step
    of_sd, of_gauges = calibration_errors(design)
    assert of_sd == pytest.approx(math.hypot(table, 0.026 * math.sqrt(lost), by_meshes), rel=1e-4)
    sizes = [np.sqrt((values**2).mean(axis=0)) for values in (readings, membrane)]
    assert of_gauges == pytest.approx(
        np.hypot(math.hypot(table, 0.03 * math.sqrt(lost)) * sizes[0], 0.0025 * sizes[1]), rel=1e-6
    )


@pytest.mark.parametrize("friction, end", [("unknown", 1), ("stick", 1), (0, 0)])
def test_surfaces_of_a_design_are_its_presses(strained, friction, end):
    """Those of the friction that is known, with the change without friction where it is not; depth in micrometres with
    an error of 0.5 %."""
    design = strained(friction=friction)
    force, modulus = design.scene.grid
    of_sd, of_gauges = calibration_errors(design)
    pairs = zip(design.surfaces.gauges, design.readings[end].T, design.readings[0].T, of_gauges, strict=True)
    for channel, readings, free, error in pairs:
        assert channel.surface(force, modulus) == pytest.approx(readings / force, rel=2e-3, abs=2.0)
        assert channel.uncertainty.sigma_at(0.3) == pytest.approx(error)
        change = channel.uncertainty.friction
        assert (change is None) == (friction != "unknown")
        if change is not None:
            assert change(force, modulus) == pytest.approx((free - readings) / force, rel=2e-3, abs=2.0)
    assert design.surfaces.surface.surface(force, modulus) == pytest.approx(np.log(design.sd[end]), abs=2e-3)
    assert design.surfaces.surface.uncertainty.sigma_at(0.3) == pytest.approx(of_sd)
    (depth,) = depth_surface(design).gauges
    per_force = 1e3 * design.depths[end] / force
    assert depth.surface(force, modulus) == pytest.approx(per_force, rel=2e-3)
    assert depth.uncertainty.sigma_at(0.3) == pytest.approx(0.005 * math.sqrt(np.mean(per_force**2)))
