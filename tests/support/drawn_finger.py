"""Fingers that are drawn, and the presses that they make by the smooth response of a coarse family."""

import numpy as np

from papilla.identification import PARAMETERS_BY_NAME
from papilla.identification.parameters import kind
from papilla.logs import PressLog
from papilla.model.specimen import Block

SIZE_MM = 2.8
FORCES, MODULI = (0.1, 0.25, 0.5, 0.98), (0.089, 0.51)
BLOCK = Block(1.0, 10.0)


def made(smooth, seed, *, noise=5.0, force_error=0.01, forces=FORCES, moduli=MODULI, depth=True, ratio=None):
    """A finger unlike the default one, its parameters, and the log of presses that it and the model agree on."""
    rng = np.random.default_rng(seed)
    outer, inner = 0.136 * np.exp(rng.uniform(-0.69, 0.69)), 0.034 * np.exp(rng.uniform(-0.5, 0.5))
    outer = outer if ratio is None else ratio * inner
    gain = np.exp(rng.uniform(np.log(0.02), 0, 5)) * rng.choice([-1, 1], 5)
    lever, zero = gain * rng.uniform(-1.8, 0.8, 5), rng.uniform(-20, 20, 5)
    force, modulus = (values.ravel() for values in np.meshgrid(forces, moduli))
    felt = smooth.felt(force * (1 + force_error * rng.normal(size=force.size)), modulus, outer, inner)
    readings = 1e6 * (gain * felt.values[:, 0] + lever * felt.values[:, 1]) + zero
    log = PressLog(
        force,
        modulus,
        readings + noise * rng.normal(size=readings.shape),
        tuple(f"g{k}" for k in range(1, 6)),
        indentation_mm=felt.indentation + 0.15 + 0.004 * noise * rng.normal(size=force.size) if depth else None,
    )
    truth = {"outer_modulus_MPa": outer, "inner_modulus_MPa": inner, "touch_down_mm": 0.15, "stick_share": 1.0}
    for name, values in (("gain", gain), ("lever_mm", lever), ("zero_microstrain", zero)):
        truth |= {f"{name}.g{k}": float(value) for k, value in enumerate(values, start=1)}
    return log, truth


def pulls(found, truth):
    """Errors over sigma of all free parameters, by kind."""
    result = {}
    for name in found.names:
        value, sigma = found[name]
        off = np.log(value / truth[name]) if PARAMETERS_BY_NAME[kind(name)].logarithmic else value - truth[name]
        result.setdefault(kind(name), []).append(off / sigma)
    return result
