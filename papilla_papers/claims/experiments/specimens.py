"""2006 IV: specimens of known modulus, distinguished by S_d and a force that is read with an error."""

from collections.abc import Sequence

import numpy as np

from papilla import fem
from papilla.calibration import Calibration, SoftnessStatus
from papilla.calibration.published import SPECIMENS_MPA
from papilla.model.finger import Finger
from papilla_papers.claims.claim import Experiment
from papilla_papers.claims.experiments.softness import GAUGE_NOISE_UE, TABLE_MODULI_MPA, calibrated, other_finger, sweep
from papilla_papers.claims.scenes import by_factors, scene

SPECIMEN_SCENE = scene("specimens")
PRESS_DRAWS: int = SPECIMEN_SCENE.about.seeds


def run(tell, cause: bool = True) -> dict:
    """Telling specimens apart by their softness.

    Presses of 0.2-0.8 N on another mesh than the calibration's, 40 draws each, gauges with 5 microstrain of noise and a
    force that is read with 1 %; the nearest stated modulus in ln E names the specimen.
    """
    tell("calibration")
    calibration = calibrated(fem.prepare(Finger.default()))
    second_mesh = other_finger()
    tell("telling specimens apart")
    right, matrix, unanswered = _confusion(second_mesh, calibration, SPECIMENS_MPA)
    mixes = [modulus_MPa for modulus_MPa in by_factors(SPECIMEN_SCENE.mixes_MPa) if modulus_MPa >= TABLE_MODULI_MPA[0]]
    share, confused, _ = _confusion(second_mesh, calibration, mixes)
    if not cause:
        right, share = (float(np.trace(np.roll(table, 1, axis=0)) / len(table)) for table in (matrix, confused))
    names = [f"{modulus:g} MPa" for modulus in SPECIMENS_MPA]
    words = "; ".join(
        f"{name}: " + " ".join(f"{named_share:.0%}" for named_share in shares)
        for name, shares in zip(names, matrix, strict=True)
    )
    return {
        "confusion": right,
        "matrix": words,
        "unanswered": unanswered,
        "mixes": share,
        "mixes_next": float(sum(np.trace(confused, offset) for offset in (-1, 0, 1)) / len(confused)),
    }


def _confusion(
    reduced: fem.ReducedFinger, calibration: Calibration, moduli: Sequence[float]
) -> tuple[float, np.ndarray, float]:
    """Share of right names, matrix (stated, named) of shares, and share without an answer."""
    rng, log_moduli = np.random.default_rng(SPECIMEN_SCENE.seed), np.log(np.asarray(moduli, float))
    matrix, lost = np.zeros((len(log_moduli), len(log_moduli))), 0
    table = sweep(reduced, sorted(float(value) for value in moduli), SPECIMEN_SCENE.pressed_N)
    for number, stated in enumerate(sorted(moduli)):
        for force in SPECIMEN_SCENE.pressed_N:
            press = int(np.flatnonzero((table.modulus_MPa == stated) & (table.force_N == force))[0])
            noise = rng.standard_normal((PRESS_DRAWS, table.reading.shape[1]))
            sd = (table.reading[press] + GAUGE_NOISE_UE * noise).std(axis=1)
            read = force * (1 + SPECIMEN_SCENE.force_error * rng.standard_normal(PRESS_DRAWS))
            estimate = calibration.invert(sd, read)
            for modulus, status in zip(np.asarray(estimate.modulus_MPa), np.asarray(estimate.status), strict=True):
                if np.isfinite(modulus):
                    matrix[number, int(np.argmin(np.abs(log_moduli - np.log(modulus))))] += 1
                elif status in (SoftnessStatus.SOFTER, SoftnessStatus.HARDER):
                    matrix[number, 0 if status == SoftnessStatus.SOFTER else -1] += 1
                    lost += 1
    total = matrix.sum()
    return float(np.trace(matrix) / total), matrix / matrix.sum(axis=1, keepdims=True), lost / total


experiment = Experiment.of(run)
