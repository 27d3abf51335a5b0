"""Softness estimators on pressed fingers: S_d alone and five gauges, each against its Cramér-Rao bound.

Readings come from the surfaces that the estimators invert (noise is then the only error), from finite-element presses,
and from presses on a mesh that the calibration has never seen: there the stated sigma has to hold what is not known.
Touches beside the apex are readings of the surfaces and real contacts there, for estimators that know of positions and
for those that do not.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np

from papilla.calibration import NORMAL_FACTOR, Calibration
from papilla.errors import InputError
from papilla.estimators.softness import GaugeSoftness, Softness
from papilla.estimators.softness.surfaces import GaugeSurfaces
from papilla.fem import ReducedFinger, prepare, press
from papilla.finger import Finger
from papilla.references.softness_bound import modulus_bound
from papilla.specimen import THICKNESS_MM, Block

MODULI_MPA = (0.05, 0.3, 0.72)
NOISES = ((20.0, 0.002), (50.0, 0.005), (50.0, 0.02))
"""Noise of a gauge (microstrain) and of the force (N)."""
PROFILES = ("press", "light", "firm")
SAMPLES = 200
BESIDE_MM = (0.5, 1.0, 2.0)
"""Where touches beside the apex lie."""
HELD_OUT = 40_000
"""First seed of the comparison; tuning used seeds below it."""
FORCES = 33
"""Presses of a profile; its samples visit them to and fro."""
DEAD = 2
"""The gauge (from 0) that is stuck in the runs with a dead gauge: the middle one tells most of the modulus."""
SLOPE_STEP = 1e-4
UNSEEN_VARIANT = 5
"""Calibrations take their mesh scatter from variants 1 to 4."""
SURFACE = "surface"
ENTRANTS = ("S_d alone", "five gauges", "five gauges, no force", "five gauges, g3 stuck")
ANYWHERE = "five gauges, any position"
BESIDE = ("S_d alone", "five gauges", ANYWHERE)
"""Entrants of touches beside the apex."""
ESTIMATORS: dict[str, Callable] = {
    "S_d alone": Softness,
    "five gauges": GaugeSoftness,
    ANYWHERE: partial(GaugeSoftness, position_sigma_mm=math.inf),
}
"""How they are made; the other entrants are five gauges with a fault."""


@dataclass(frozen=True)
class SoftnessRow:
    """One estimator on one specimen, over all trials; errors are of ln E.

    mesh : "surface" (readings from the calibration's surfaces, which are then taken as exact), or the name of a finger
    that was pressed; position_mm : x of the touch. error : RMS. bound : Cramér-Rao, of the noise and, with a finger, of
    the stated errors of the calibration, for what the estimator takes as known. bias_over_bound : mean error over the
    bound: one mesh's error is the same in all trials. sigma_ratio : RMS of error over stated sigma. coverage : share of
    trials whose truth lies within the stated 95 % (1.96 sigma in ln E). answered : share of trials with an answer.
    """

    estimator: str
    mesh: str
    profile: str
    position_mm: float
    modulus_MPa: float
    gauge_sigma: float
    force_sigma_N: float
    error: float
    bound: float
    error_over_bound: float
    bias_over_bound: float
    sigma_ratio: float
    coverage: float
    answered: float

    @property
    def place(self) -> str:
        """Where the readings come from, in words."""
        return f"{self.mesh}, x {self.position_mm:g} mm" if self.mesh == SURFACE and self.position_mm else self.mesh


def force_profile(name: str) -> np.ndarray:
    """(SAMPLES,) force in N: "press" goes from 0.15 to 0.9 and back, "light" and "firm" waver about 0.12 and 0.8.

    Raises `InputError` for another name.
    """
    low, high = _limits(name)
    places = np.abs((np.arange(SAMPLES) * 2 * (FORCES - 1) // SAMPLES) - (FORCES - 1))
    return np.linspace(low, high, FORCES)[FORCES - 1 - places]


def _limits(name: str) -> tuple[float, float]:
    limits = {"press": (0.15, 0.9), "light": (0.1, 0.14), "firm": (0.75, 0.85)}
    if name not in limits:
        raise InputError(f"profile must be one of {', '.join(PROFILES)}, got {name!r}")
    return limits[name]


def pressed_readings(reduced: ReducedFinger, modulus_MPa: float, profile: str) -> np.ndarray:
    """(SAMPLES, g) readings in microstrain of presses on a 10 mm block at the finger's touch-down point, without noise;
    raises what `press` raises."""
    forces, start, rows = np.linspace(*_limits(profile), FORCES), None, {}
    for force in forces.tolist():
        found = press(reduced, Block(modulus_MPa, THICKNESS_MM), force=force, start=start)
        start, rows[force] = found.active, found.reading
    return np.array([rows[force] for force in force_profile(profile).tolist()])


def gauge_bound(
    calibration: Calibration,
    modulus: float,
    force,
    gauge_sigma: float,
    force_sigma_N: float,
    used=None,
    position_mm: float | None = None,
):
    """Bound of ln E from the gauges `used` (their numbers, all by default) at forces (n,), with the errors of the
    calibration: of each gauge, but the same for gauges that mirror each other.

    position_mm : x of the contact, which is then an unknown of each sample; None where it is known to be the apex.
    """
    force = np.asarray(force, float)
    picked = list(range(len(calibration.gauges))) if used is None else list(used)
    along_modulus, along_force = _slopes(
        lambda force, modulus: calibration.predict_readings(force, modulus, position_mm), force, modulus
    )
    surfaces = GaugeSurfaces(calibration)
    errors = np.zeros((len(force), len(picked), max(surfaces.groups) + 1))
    for row, value in enumerate(force):
        own = surfaces.errors[surfaces.force_cell(math.log(value))]
        for place, number in enumerate(picked):
            group = surfaces.groups[number]
            errors[row, place, group] = own[group] * value
    known = along_modulus[:, picked], along_force[:, picked], gauge_sigma, force_sigma_N
    if position_mm is None:
        return modulus_bound(*known, errors)
    ends = (calibration.predict_readings(force, modulus, position_mm + step) for step in (SLOPE_STEP, -SLOPE_STEP))
    along_x = np.subtract(*ends)[:, picked] / (2 * SLOPE_STEP)
    terms = calibration.position_terms
    nodes = np.linspace(-terms.reach_mm, terms.reach_mm, terms.error.shape[1])
    moved = [np.interp(position_mm, nodes, terms.error[number]) for number in picked]
    errors = np.concatenate([errors, force[:, None, None] * np.diag(moved)], axis=2)
    return modulus_bound(*known, errors, [(along_x, math.inf)])


def sd_bound(calibration: Calibration, modulus: float, force, gauge_sigma: float, force_sigma_N: float) -> float:
    """Bound of ln E from S_d and force (n,), with the error of the calibrated S_d."""
    force, known = np.asarray(force, float), calibration.surface.uncertainty
    along_modulus, along_force = _slopes(calibration.predict, force, modulus)
    noise = gauge_sigma / math.sqrt(len(calibration.gauges))
    errors = [math.hypot(known.fit_rms, known.scatter_at(value)) for value in force.tolist()]
    moved = np.array(errors) * calibration.predict(force, modulus)
    return modulus_bound(along_modulus[:, None], along_force[:, None], noise, force_sigma_N, moved[:, None, None])


def taken_as_exact(calibration: Calibration) -> Calibration:
    """The calibration without any stated error: what is left is the noise."""

    def sure(readout):
        known = readout.uncertainty
        return replace(readout, uncertainty=replace(known, fit_rms=0.0, fit_max=0.0, scatter=0.0 * known.scatter))

    terms = calibration.position
    return replace(
        calibration,
        surface=sure(calibration.surface),
        gauges=tuple(map(sure, calibration.gauges)),
        position=None if terms is None else replace(terms, error=0.0 * terms.error),
    )


def study_fingers(finger: Finger, progress: Callable[[str], None] | None = None) -> dict[str, ReducedFinger]:
    """The finger on the mesh of its calibration and on one that no calibration uses, at the apex and beside it (made
    once, then cached)."""
    fingers = {}
    for mesh, variant in {"calibrated": 0, "unseen": UNSEEN_VARIANT}.items():
        for x in (0.0, *BESIDE_MM[1:]):
            name = mesh if x == 0 else f"{mesh}, x {x:g} mm"
            fingers[name] = prepare(finger, variant=variant, at=(x, 0.0), progress=progress)
    return fingers


def _slopes(predict: Callable, force: np.ndarray, modulus: float) -> tuple[np.ndarray, np.ndarray]:
    """Central differences of a prediction in ln E, and in force."""
    up, down = 1 + SLOPE_STEP, 1 - SLOPE_STEP
    along_modulus = (predict(force, modulus * up) - predict(force, modulus * down)) / (2 * SLOPE_STEP)
    along_ln_force = (predict(force * up, modulus) - predict(force * down, modulus)) / (2 * SLOPE_STEP)
    return along_modulus, (along_ln_force.T / force).T


def compare_softness(
    calibration: Calibration,
    fingers: dict[str, ReducedFinger],
    *,
    trials: int = 100,
    moduli: Sequence[float] = MODULI_MPA,
    noises: Sequence[tuple[float, float]] = NOISES,
    profiles: Sequence[str] = PROFILES,
    places_mm: Sequence[float] = (0.0, *BESIDE_MM),
    entrants: Sequence[str] = (*ENTRANTS, ANYWHERE),
    first_seed: int = HELD_OUT,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[SoftnessRow, ...]:
    """The table: S_d alone, five gauges, five without a force sensor, five with the middle gauge stuck, and five whose
    touches may lie anywhere; the first, the second and the last of them also beside the apex, in the first profile and
    with the first noise.

    Parameters
    ----------
    calibration : nothing lies beside the apex where it knows no contact positions.
    fingers : name ("calibrated", "unseen", ...) -> finger whose presses are measured; see `study_fingers`.
    trials : noisy repetitions of each press; noise is the same for all estimators.
    places_mm : x of the touches whose readings are of the surfaces; those of a finger are where it was condensed.
    entrants : which of the estimators.
    progress : called with rows of the table done and total.

    Raises `InputError` for fewer than two trials or an unknown profile, and what `press` raises.
    """
    if trials < 2:
        raise InputError(f"trials must be at least 2, got {trials}")
    cases = list(_cases(calibration, fingers, moduli, noises, profiles, places_mm, entrants))
    rows: list[SoftnessRow] = []
    total = sum(len(here) for _, here in cases)
    pressed: dict[tuple, np.ndarray] = {}
    for case, here in cases:
        force, reduced = force_profile(case.profile), fingers.get(case.mesh)
        key = case.mesh, case.profile, case.position_mm, case.modulus_MPa
        if key not in pressed:
            pressed[key] = (
                calibration.predict_readings(force, case.modulus_MPa, case.position_mm or None)
                if reduced is None
                else pressed_readings(reduced, case.modulus_MPa, case.profile)
            )
        known = taken_as_exact(calibration) if reduced is None else calibration
        seeds = range(first_seed, first_seed + trials)
        blocks = [noisy(pressed[key], force, case.gauge_sigma, case.force_sigma_N, seed) for seed in seeds]
        for entrant in here:
            rows.append(_row(entrant, known, case, force, blocks))
            progress(len(rows), total)
    return tuple(rows)


class _Case(NamedTuple):
    mesh: str
    profile: str
    position_mm: float
    modulus_MPa: float
    gauge_sigma: float
    force_sigma_N: float


def _cases(
    calibration: Calibration, fingers, moduli, noises, profiles, places_mm, entrants
) -> Iterator[tuple[_Case, tuple[str, ...]]]:
    """All scenes of the table, at the apex and beside it."""
    anywhere = calibration.position is not None
    places = [(SURFACE, x) for x in places_mm] + [(name, reduced.at[0]) for name, reduced in fingers.items()]
    able = [name for name in entrants if anywhere or name != ANYWHERE]
    for mesh, x in places:
        if x and not anywhere:
            continue
        scenes = product(profiles[:1], moduli, noises[:1]) if x else product(profiles, moduli, noises)
        here = tuple(name for name in able if not x or name in BESIDE)
        for profile, modulus, (gauge_sigma, force_sigma_N) in scenes:
            yield _Case(mesh, profile, x, modulus, gauge_sigma, force_sigma_N), here


def noisy(readings, force, gauge_sigma: float, force_sigma_N: float, seed: int) -> np.ndarray:
    """A block (n, g + 1): readings (n, g) in microstrain and force (n,) in N, each with white noise of its sigma."""
    rng = np.random.default_rng(seed)
    measured = readings + gauge_sigma * rng.normal(size=readings.shape)
    return np.column_stack([measured, force + force_sigma_N * rng.normal(size=len(force))])


def _row(entrant: str, calibration: Calibration, case: _Case, force: np.ndarray, blocks: list) -> SoftnessRow:
    modulus = case.modulus_MPa
    options: dict = {"gauge_sigma": case.gauge_sigma, "force_sigma_N": case.force_sigma_N}
    known: dict = {}
    if entrant == ANYWHERE:
        known = {"position_mm": case.position_mm}
    elif entrant == "five gauges, no force":
        options["force_sigma_N"] = math.inf
        blocks = [np.column_stack([block[:, :-1], np.full(len(block), np.nan)]) for block in blocks]
    elif entrant == "five gauges, g3 stuck":
        known = {"used": [number for number in range(len(calibration.gauges)) if number != DEAD]}
        blocks = [_stuck(block) for block in blocks]
    own_bound = sd_bound if entrant == "S_d alone" else gauge_bound
    bound = own_bound(calibration, modulus, force, **options, **known)
    estimator = ESTIMATORS.get(entrant, GaugeSoftness)(calibration, **options)
    found = np.array([_last(estimator, block) for block in blocks])
    told = np.isfinite(found).all(axis=1)
    error = np.log(found[told, 0] / modulus)
    relative = found[told, 1] / found[told, 0]
    nothing = not told.any()
    rms = math.nan if nothing else math.sqrt(np.mean(error**2))
    return SoftnessRow(
        entrant,
        *case,
        error=rms,
        bound=bound,
        error_over_bound=rms / bound,
        bias_over_bound=math.nan if nothing else float(error.mean()) / bound,
        sigma_ratio=math.nan if nothing else math.sqrt(np.mean((error / relative) ** 2)),
        coverage=math.nan if nothing else float(np.mean(np.abs(error) <= NORMAL_FACTOR * relative)),
        answered=float(told.mean()),
    )


def _stuck(block: np.ndarray) -> np.ndarray:
    """The block with the middle gauge silent, as a broken lead leaves it."""
    block = block.copy()
    block[:, DEAD] = 0.0
    return block


def _last(estimator, block: np.ndarray) -> tuple[float, float]:
    estimator.reset()
    answer = estimator.process(block)
    return float(answer.modulus_MPa[-1]), float(answer.modulus_sigma_MPa[-1])
