"""Expected sigma of ln E after a touch, by the estimators' own filter; the same for a prediction and for a calibration.

A touch begins in the air, where zeros are measured, and ends at a force that is held for some samples. The filter
(`papilla.estimators.softness.fitter`) starts at the true contact and learns the mean of these samples like a measured
one; its sigma does not depend on the noise that occurred. Its own prior of E is replaced by one that is the same for
every design, with a standard deviation of 1 in ln E.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from papilla.design.scene import Scene
from papilla.errors import InputError
from papilla.estimators.softness.fitter import PRIOR_REACH, Fitter
from papilla.estimators.softness.surfaces import GaugeSurfaces, SdSurface
from papilla.estimators.softness.touch import RULES
from papilla.units import UM_PER_MM

PRIOR = 1.0
"""One sigma of ln E before a touch, which remains if a touch gives no information."""


def sigma_from_sd(calibration: Any, scene: Scene) -> np.ndarray:
    """Sigma (f, m) of ln E from S_d and force, over the points of a scene.

    calibration : a `Calibration`, or `DesignInScene.surfaces` of a design.
    """
    # S_d averages over the gauges, so their independent noise and zeros shrink by the root of their number.
    gauges = len(calibration.gauges)
    doubts = scene.unknown.doubts
    doubts = replace(doubts, zero_microstrain=doubts.zero_microstrain / math.sqrt(gauges))
    try:
        surface = SdSurface(calibration)
    except InputError:
        return np.full([len(part) for part in scene.points], PRIOR)
    return _over(
        Fitter(surface, scene.gauge_noise_microstrain / math.sqrt(gauges), scene.force_noise_N, doubts, None), scene
    )


def sigma_from_gauges(calibration: Any, scene: Scene) -> np.ndarray:
    """The same from all gauges and force."""
    surfaces = GaugeSurfaces(calibration, False)
    return _over(
        Fitter(surfaces, scene.gauge_noise_microstrain, scene.force_noise_N, scene.unknown.doubts, None), scene
    )


def sigma_from_depth(depth: Any, scene: Scene) -> np.ndarray:
    """The same from force and indentation, as measured on a bench; `depth` has one "gauge" that reads micrometres."""
    zero = UM_PER_MM * scene.depth_zero_mm / RULES.air_share
    doubts = replace(scene.unknown.doubts, gauge_gain=0.0, zero_microstrain=zero, beside_mm=0.0)
    return _over(
        Fitter(GaugeSurfaces(depth, False), UM_PER_MM * scene.depth_noise_mm, scene.force_noise_N, doubts, None), scene
    )


def _over(fitter: Fitter, scene: Scene) -> np.ndarray:
    forces, moduli = scene.points
    return np.array([[_at(fitter, math.log(f), math.log(e), scene.samples) for e in moduli] for f in forces])


def _at(fitter: Fitter, ln_force: float, ln_modulus: float, samples: int) -> float:
    nodes = fitter.surfaces.ln_nodes
    usable = getattr(fitter.surfaces, "usable", None)
    low, high = usable(ln_force) if usable else (nodes[0], nodes[-1])
    if not max(low, nodes[0]) <= ln_modulus <= min(high, nodes[-1]):
        return PRIOR
    # The filter's unknown is h, a scale of ln E on which readings change along straight lines (`softness.fitter`). The
    # touch starts at its true h, so that the slopes are those of the true contact.
    h = _distance(fitter, ln_modulus)
    state = fitter.prior(RULES.air_share)
    mean = state.mean.copy()
    mean[0] = h
    state = state._replace(mean=mean, ln_force=ln_force, anchor=h)
    rows = np.arange(fitter.channels + 1)
    y = fitter.linear(ln_force, 0.0, h).expected / fitter.whiten
    _, learnt = fitter.learn(y, rows, state, fitter.noise_fit(y, rows, state, samples))
    prior, after = (PRIOR_REACH * fitter.top) ** 2, float(learnt.covariance[0, 0])
    # What the touch added to the filter's own prior of h, in units of ln E, with this module's prior instead.
    information = max(1 / after - 1 / prior, 0.0) * fitter.ln_modulus(h)[1] ** 2
    return 1 / math.sqrt(information + PRIOR**-2)


def _distance(fitter: Fitter, ln_modulus: float) -> float:
    """h at a modulus."""
    curve = fitter.curve
    place = (ln_modulus - curve.start) * curve.per_step
    cell = min(int(place), len(curve.cubics) - 1)
    p, q, r, s = curve.cubics[cell]
    u = place - cell
    return p + u * (q + u * (r + u * s))
