"""Cramér-Rao bound of a specimen's modulus from readings of gauges, a noisy force and what else is not known."""

import math
from collections.abc import Sequence

import numpy as np

from papilla import checks
from papilla.errors import InputError


def modulus_bound(
    along_modulus, along_force, reading_sigma: float, force_sigma: float, errors=None, nuisances: Sequence[tuple] = ()
) -> float:
    """Smallest standard deviation of ln E of an unbiased estimate from n samples of g readings and of the force.

    Every sample has its own unknown force, which its readings and the force sensor measure together; E is common to
    all. S_d alone is one reading (g = 1) whose sigma is that of a gauge over sqrt(gauges).

    Parameters
    ----------
    along_modulus, along_force : (n, g) slopes of the readings in ln E (microstrain) and in force (microstrain / N).
    reading_sigma : standard deviation of the noise of a reading, microstrain, > 0.
    force_sigma : that of the force, N, > 0; inf where there is no force sensor.
    errors : (n, g, k) what one sigma of each of k calibration errors adds to the readings; the errors are the same in
        all samples, so they do not average out (the bound is then the hybrid one: E a parameter, the errors random).
    nuisances : (slopes (n, g) of the readings, prior standard deviation) of each further quantity that every sample has
        its own of, such as the place of the contact; inf where there is no prior.

    Returns inf where the readings do not tell the modulus. Raises `InputError` for shapes that do not fit.
    Source: Fisher information with the nuisance eliminated by its Schur complement; van Trees, Detection, Estimation
    and Modulation Theory I (1968), section 2.4, ISBN 978-0471095170; Rockah and Schultheiss (1987) for the hybrid
    bound, doi:10.1109/TASSP.1987.1165144.
    """
    noise = checks.positive("reading_sigma", reading_sigma)
    if not force_sigma > 0:
        raise InputError(f"force_sigma must be greater than 0, got {force_sigma}")
    a, b = (np.asarray(slopes, float) for slopes in (along_modulus, along_force))
    if a.ndim != 2 or a.shape != b.shape:
        raise InputError(f"slopes must be two arrays (n, g), got {a.shape} and {b.shape}")
    parts = np.zeros((*a.shape, 0)) if errors is None else np.asarray(errors, float)
    if parts.shape[:2] != a.shape or parts.ndim != 3:
        raise InputError(f"errors must be (n, g, k) with n x g = {a.shape}, got {parts.shape}")
    design = np.concatenate([a[..., None], parts], axis=2) / noise
    slopes, precisions = [b], [force_sigma**-2.0]
    for along, sigma in nuisances:
        slopes.append(np.asarray(along, float))
        if slopes[-1].shape != a.shape or not sigma > 0:
            raise InputError(
                f"a nuisance must be slopes {a.shape} and a sigma above 0, got {slopes[-1].shape}, {sigma}"
            )
        precisions.append(sigma**-2.0)
    own = np.stack(slopes, axis=2) / noise
    gram = np.einsum("ngi,ngj->ij", design, design)
    own_information = np.einsum("ngk,ngl->nkl", own, own) + np.diag(precisions)
    mixed = np.einsum("ngi,ngk->nki", design, own)
    gram -= np.einsum("nki,nkj->ij", mixed, np.linalg.pinv(own_information, hermitian=True) @ mixed)
    gram[1:, 1:] += np.eye(parts.shape[2])
    information = gram[0, 0] - gram[0, 1:] @ np.linalg.solve(gram[1:, 1:], gram[1:, 0])
    return 1 / math.sqrt(information) if information > 1e-12 * (design[..., 0] ** 2).sum() else math.inf
