"""2006 IV: specimens of known modulus, distinguished by S_d and a force that is read with an error."""

from collections.abc import Sequence

import numpy as np

from papilla import fem
from papilla.calibration import Calibration, SoftnessStatus
from papilla.calibration.published import SPECIMENS_MPA
from papilla.model.finger import Finger
from papilla_papers.claims.experiments.softness import MODULI, NOISE, calibrated, other_finger, sweep
from papilla_papers.claims.scenes import by_factors, scene

SCENE = scene("specimens")
DRAWS: int = SCENE.about.seeds


def run(tell, cause: bool = True) -> dict:
    """Telling specimens apart by their softness.

    Presses of 0.2-0.8 N on another mesh than the calibration's, 40 draws each, gauges with 5 microstrain of noise and a
    force that is read with 1 %; the nearest stated modulus in ln E names the specimen.
    """
    tell("calibration")
    calibration = calibrated(fem.prepare(Finger.default()))
    other = other_finger()
    tell("telling specimens apart")
    told, matrix, unanswered = _confusion(other, calibration, SPECIMENS_MPA)
    mixes = [one for one in by_factors(SCENE.mixes_MPa) if one >= MODULI[0]]
    share, confused, _ = _confusion(other, calibration, mixes)
    if not cause:
        told, share = (float(np.trace(np.roll(table, 1, axis=0)) / len(table)) for table in (matrix, confused))
    names = [f"{modulus:g} MPa" for modulus in SPECIMENS_MPA]
    words = "; ".join(
        f"{name}: " + " ".join(f"{part:.0%}" for part in row) for name, row in zip(names, matrix, strict=True)
    )
    return {
        "confusion": told,
        "matrix": words,
        "unanswered": unanswered,
        "mixes": share,
        "mixes_next": float(sum(np.trace(confused, offset) for offset in (-1, 0, 1)) / len(confused)),
    }


def _confusion(
    reduced: fem.ReducedFinger, calibration: Calibration, moduli: Sequence[float]
) -> tuple[float, np.ndarray, float]:
    """Share of right names, matrix (stated, named) of shares, and share without an answer."""
    rng, known = np.random.default_rng(SCENE.seed), np.log(np.asarray(moduli, float))
    matrix, lost = np.zeros((len(known), len(known))), 0
    table = sweep(reduced, sorted(float(value) for value in moduli), SCENE.pressed_N)
    for number, stated in enumerate(sorted(moduli)):
        for force in SCENE.pressed_N:
            row = int(np.flatnonzero((table.modulus_MPa == stated) & (table.force_N == force))[0])
            noise = rng.standard_normal((DRAWS, table.reading.shape[1]))
            sd = (table.reading[row] + NOISE * noise).std(axis=1)
            read = force * (1 + SCENE.force_error * rng.standard_normal(DRAWS))
            found = calibration.invert(sd, read)
            for told, status in zip(np.asarray(found.modulus_MPa), np.asarray(found.status), strict=True):
                if np.isfinite(told):
                    matrix[number, int(np.argmin(np.abs(known - np.log(told))))] += 1
                elif status in (SoftnessStatus.SOFTER, SoftnessStatus.HARDER):
                    matrix[number, 0 if status == SoftnessStatus.SOFTER else -1] += 1
                    lost += 1
    total = matrix.sum()
    return float(np.trace(matrix) / total), matrix / matrix.sum(axis=1, keepdims=True), lost / total
