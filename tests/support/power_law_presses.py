"""A problem of presses whose responses are powers of the loads, so that fits of it take milliseconds."""

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

from papilla.identification import Noise
from papilla.identification.parameters import start_of
from papilla.identification.posing import free_parameters
from papilla.identification.presses import Shape
from papilla.identification.problem import Problem, unread
from papilla.model.finger import Finger
from papilla.model.specimen import Block

FINGER = replace(Finger.default(), gauges=Finger.default().gauges[:3])
GAUGES = tuple(gauge.name for gauge in FINGER.gauges)
STRAIN, CURVATURE = np.array([1.0, -2.0, 0.4]), np.array([0.3, 0.8, -0.5])
NOISE = Noise(5.0, 0.01, 0.02, model=0.008, depth=0.01, beyond=0.02)


@dataclass(frozen=True)
class Powers:
    """Strain, curvature and indentation are powers of the loads, each of another exponent."""

    strained: float = 1e9
    error: float = 0.003
    friction: float = math.inf
    large_strain: bool = True
    most: float = 1e9
    specimen = "a block"

    def inside(self, force, modulus, outer, inner):
        return force / inner <= self.most

    def felt(self, force, modulus, outer, inner):
        logs = [np.log(force / inner), np.log(modulus / inner), np.full(len(force), np.log(outer / inner))]
        exponents = np.array([[0.7, 0.2, -0.3], [0.5, 0.3, 0.1], [0.6, -0.2, -0.1]])
        strain, curvature, depth = (np.exp(exponent @ logs) for exponent in exponents)
        values = 1e-4 * np.stack([np.outer(strain, STRAIN), np.outer(curvature, CURVATURE)], axis=1)
        slopes = np.stack([values * exponents[:2, k, None] for k in range(3)])
        return SimpleNamespace(
            values=values,
            indentation=0.1 * depth,
            slope_values=slopes,
            slope_indentation=np.multiply.outer(exponents[2], 0.1 * depth),
        )


def problem(*, free=None, force=(0.1, 0.3, 0.5, 0.9), deep=True, response=None, **held):
    """Presses of a finger of known parameters, measured without noise."""
    force = np.array(force)
    modulus = np.resize([0.1, 0.3, 0.7], len(force))
    log = unread(FINGER, force, modulus, None, np.ones(len(force)) if deep else None)
    values = start_of(FINGER) | {f"gain.{name}": gain for name, gain in zip(GAUGES, (0.3, -0.5, 0.2), strict=True)}
    values |= {f"lever_mm.{name}": lever for name, lever in zip(GAUGES, (-0.1, 0.3, 0.05), strict=True)}
    values |= {"zero_microstrain.g2": 7.0, "touch_down_mm": 0.15, "common_lever_mm": -0.2} | held
    names = free_parameters(log, FINGER, (), {}) if free is None else free
    shapes = (Shape(np.arange(len(force)), Block(1.0, 10.0), (response or Powers(),)),)
    made = Problem(log, FINGER, shapes, values, names, NOISE)
    read = made.modelled(made.start).values
    return replace(made, log=replace(log, readings=read[:, :3], indentation_mm=read[:, 3] if deep else None))


def with_sd(made):
    """The same presses, of which S_d alone is known."""
    nothing = np.zeros((len(made.log), 0))
    log = replace(made.log, readings=nothing, gauge_names=(), stated_sd=made.log.readings.std(axis=1))
    return replace(made, log=log, free=("outer_modulus_MPa", "inner_modulus_MPa", "common_gain"))
