"""Suggests the next presses: those that determine a finger best, by the derivatives of what they would measure.

A design is chosen for the fit that follows it (Atkinson, Donev and Tobias, Optimum Experimental Designs, 2007, chapters
10 and 12): I-optimal designs minimise the mean variance over the domain of the ln E that S_d gives; D-optimal designs
minimise the determinant of the parameters' covariance. Both depend on the parameters, which are not known beforehand.
So the logarithm of the criterion is averaged over fingers: those of the prior before the first press, the identified
finger afterwards.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from papilla.calibration.fitting.sweep import CalibrationRanges
from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.progress import silent
from papilla.core.units import gf_to_newton
from papilla.fem.pressing.off_apex import MoveLimits
from papilla.fem.pressing.response import RATIO_LIMITS
from papilla.identification import posing
from papilla.identification.fit import Identification
from papilla.identification.noise import PressNoise
from papilla.identification.parameters import start_of
from papilla.identification.posing import free_parameters, shapes_of
from papilla.identification.presses import refuse_far
from papilla.identification.problem import Problem, sd_and_shares, unread
from papilla.model.finger import Finger
from papilla.model.specimen import Specimen

Criterion = Literal["I", "D"]
APEX_PLACE = (0.0, 0.0)

Presses = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Forces (n,) in N, moduli (n,) in MPa and places (n, 2) in mm of presses."""

SUGGESTED_FORCES_N = tuple(gf_to_newton(gf) for gf in (5, 7, 10, 14, 20, 28, 40, 55, 75, 100))
"""Forces among which presses on the default finger are suggested, unless others are given; on another finger these
times the factor of its `CalibrationRanges`."""

DOMAIN_GRID_POINTS = 6
"""Number of points along each axis of the domain over which E should be determined well."""

LEAST_CRITERION_SLOPE = 0.02
"""Smallest d ln S_d / d ln E in the criterion: where the slope is smaller, S_d does not determine E, and the weight
does not grow further."""

PRIOR_DRAWS = 12
"""Number of fingers of the prior over which a protocol without presses is averaged."""

DRAWN_GAINS, DRAWN_LEVERS_PER_GAIN_MM, LARGEST_MODULUS_FACTOR = (0.02, 1.0), (-2.0, 1.0), 2.0
"""Their gains, and levers over gains; their moduli differ from the design's by up to this factor."""

MOST_PRESS_EXCHANGES = 20
"""Largest number of rounds of exchange: each tries the best candidate in place of every press in turn."""


@dataclass(frozen=True)
class Suggestion:
    """k presses, the most informative first, and the uncertainty that is expected after them.

    force_N, modulus_MPa : (k,) of the presses. place_mm : (k, 2) where they touch down.
    sigma_before, sigma_after : expected standard deviation of ln E over the domain, from the uncertainty of the finger
    alone, without the noise of a later press. criterion : "I" or "D". domain : forces and moduli, in words.
    """

    force_N: tuple[float, ...]
    modulus_MPa: tuple[float, ...]
    place_mm: tuple[tuple[float, float], ...]
    sigma_before: float
    sigma_after: float
    criterion: Criterion
    domain: str = ""


@dataclass(frozen=True, eq=False)
class _Finger:
    """Information of the presses on one finger: c channels, f parameters, n candidates, m points of the domain.

    known (f, f) : information of priors and presses made. each (n, f, f) : that of each candidate. slope (m, f) :
    derivatives of the ln E that S_d gives, by the parameters.
    """

    known: np.ndarray
    each: np.ndarray
    slope: np.ndarray

    def log_variance(self, information: np.ndarray) -> np.ndarray:
        """ln of the mean variance of ln E (...) at informations (..., f, f)."""
        variance = np.einsum("mf,...fg,mg->...m", self.slope, np.linalg.inv(information), self.slope)
        return np.log(variance.mean(axis=-1))


def suggest_presses(
    known: Identification | Finger,
    count: int,
    moduli: Sequence[float],
    *,
    forces: Sequence[float] | None = None,
    places: Sequence[tuple[float, float]] = (APEX_PLACE,),
    specimen: Specimen | None = None,
    criterion: Criterion = "I",
    noise: PressNoise | None = None,
    seed: int = 0,
    size_mm: float | None = None,
) -> Suggestion:
    """The next `count` presses on specimens of some `moduli` (MPa) by some `forces` (N) at some `places` (x, y in mm).

    forces : None takes `SUGGESTED_FORCES_N` for the finger's size and hardness. Presses that the model of the finger
    refuses, because their contact would leave its patch, are not suggested.

    known : an identification, whose presses are taken into account; or a design, for a protocol that begins without
    presses and holds for any finger of its geometry. specimen : the shape of the specimens of a design's protocol, a
    block by default; an identification has its own. noise, size_mm : as for `identify`, with a design.

    Raises `InputError` for a count below 1, no moduli, forces or places, moduli or forces that are not positive, and
    places too far from the apex.
    """
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        raise InputError(f"the number of presses to suggest must be at least 1, got {count!r}")
    if criterion not in ("I", "D"):
        raise InputError(f"criterion must be I or D, got {criterion!r}")
    ranges = CalibrationRanges.of(known.problem.finger if isinstance(known, Identification) else known)
    forces = ranges.forced(SUGGESTED_FORCES_N) if forces is None else forces
    grid = [
        np.array(sorted({checks.positive(f"{name} to press", value) for value in values}))
        for name, values in (("force (N)", forces), ("modulus (MPa)", moduli))
    ]
    if not all(len(axis) for axis in grid):
        raise InputError("suggesting presses needs at least one force and one modulus")
    spots = np.array(sorted({checks.place("place to press", place_mm) for place_mm in places})).reshape(-1, 2)
    if not len(spots):
        raise InputError("suggesting presses needs at least one place")
    index = np.meshgrid(*(np.arange(len(axis)) for axis in (*grid, spots)), indexing="ij")
    force, modulus, place = (axis[axis_index.ravel()] for axis, axis_index in zip((*grid, spots), index, strict=True))
    candidates = force, modulus, place
    if isinstance(known, Identification):
        # Presses made count with their own weights; priors are those of the problem.
        jacobian = known.problem.jacobian(known.vector)
        problem = _able(known.problem, candidates, size_mm)
        fingers = [_finger(problem, known.vector, candidates, jacobian.T @ jacobian)]
    else:
        problem, vectors = _from_nothing(known, candidates, specimen, noise or PressNoise(), seed, size_mm)
        fingers = [_finger(problem, vector, candidates, None) for vector in vectors]
    able = _pressable(problem, known.values if isinstance(known, Identification) else problem.held, candidates)
    if not able.any():
        raise InputError("no press to suggest: the model of this finger covers none of these forces and moduli")
    force, modulus, place = force[able], modulus[able], place[able]
    fingers = [replace(finger, each=finger.each[able]) for finger in fingers]
    chosen = _exchanged(fingers, _greedy(fingers, count, criterion), criterion)
    spread = [
        float(
            np.exp(
                np.mean([finger.log_variance(finger.known + finger.each[rows].sum(axis=0)) for finger in fingers]) / 2
            )
        )
        for rows in ([], chosen)
    ]
    spots_chosen = tuple((x, y) for x, y in place[chosen].tolist())
    best = tuple(force[chosen].tolist()), tuple(modulus[chosen].tolist()), spots_chosen
    return Suggestion(*best, spread[0], spread[1], criterion, ranges.checked_in_words)


def _pressable(problem: Problem, values: Mapping[str, float], candidates: Presses) -> np.ndarray:
    """(n,) whether the model of a finger with these parameters covers a press with each friction that is possible."""
    pressed, inside = problem.of(*candidates), np.ones(len(candidates[0]), bool)
    moduli = values["outer_modulus_MPa"], values["inner_modulus_MPa"]
    for shape in pressed.shapes:
        loads = candidates[0][shape.rows], candidates[1][shape.rows]
        for response in shape.responses:
            inside[shape.rows] &= response.inside(*loads, *moduli)
    return inside


def _able(problem: Problem, candidates: Presses, size_mm: float | None) -> Problem:
    """The problem with the changes by contacts beside the apex, if there are such candidates."""
    if not candidates[2].any():
        return problem
    relatives = posing.family_of(problem.finger, size_mm=size_mm)
    refuse_far(unread(problem.finger, *candidates), MoveLimits.of(relatives), problem.free)
    return replace(problem, shapes=(*posing.with_moves(problem.shapes[:1], relatives), *problem.shapes[1:]))


def _from_nothing(
    design: Finger, candidates: Presses, specimen: Specimen | None, noise: PressNoise, seed: int, size_mm: float | None
) -> tuple[Problem, list[np.ndarray]]:
    """The problem of the candidates of a design, without measurements, and vectors (f,) of fingers of its prior."""
    empty = unread(design, *candidates)
    touched = specimen or design.bench.specimen(1.0)
    shapes = shapes_of(empty, touched, design, (), {}, None, size_mm, silent)
    start = start_of(design)
    problem = Problem(empty, design, shapes, start, free_parameters(empty, design, (), {}), noise)
    random, vectors = np.random.default_rng(seed), []
    for _ in range(PRIOR_DRAWS):
        drawn = dict(start)
        inner = drawn["inner_modulus_MPa"] * LARGEST_MODULUS_FACTOR ** random.uniform(-1, 1)
        ratio = (
            drawn["outer_modulus_MPa"] / drawn["inner_modulus_MPa"] * LARGEST_MODULUS_FACTOR ** random.uniform(-1, 1)
        )
        drawn["inner_modulus_MPa"] = inner
        drawn["outer_modulus_MPa"] = inner * float(np.clip(ratio, *RATIO_LIMITS))
        for name in problem.gauges:
            drawn[f"gain.{name}"] = float(np.exp(random.uniform(*np.log(DRAWN_GAINS))))
            drawn[f"lever_mm.{name}"] = drawn[f"gain.{name}"] * random.uniform(*DRAWN_LEVERS_PER_GAIN_MM)
        vectors.append(replace(problem, held=drawn).start)
    return problem, vectors


def _finger(problem: Problem, vector: np.ndarray, candidates: Presses, earlier: np.ndarray | None) -> _Finger:
    """Information of the candidates for the finger of a vector (f,); earlier (f, f) : of earlier presses, None for the
    priors alone."""
    pressed = _pressed(problem, vector, candidates)
    jacobian = pressed.jacobian(vector)
    priors = len(problem.free) + 1
    by_candidate = jacobian[:-priors].reshape(len(candidates[0]), -1, len(problem.free))
    prior = jacobian[-priors:]
    of_sd, slope = sd_slopes(problem, vector)
    # S_d (f, E; p) is given and E follows from it, so an error of a parameter p acts on the modulus by
    # d ln E / dp = -(d ln S_d / dp) / (d ln S_d / d ln E). The sign has no effect.
    # Each candidate adds the outer products of its rows: information is additive over presses.
    information = np.einsum("ncf,nch->nfh", by_candidate, by_candidate)
    by_modulus = of_sd / np.maximum(np.abs(slope), LEAST_CRITERION_SLOPE)[:, None]
    return _Finger(prior.T @ prior if earlier is None else earlier, information, by_modulus)


def sd_slopes(problem: Problem, vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of ln S_d by the parameters (m, f) and by ln modulus of the specimen (m,), at m presses over the
    domain in which E should be determined well, for a vector (f,)."""
    ends = CalibrationRanges.of(problem.finger).checked
    grid = np.meshgrid(*(np.geomspace(low, high, DOMAIN_GRID_POINTS) for low, high in ends))
    alone = replace(problem, log=replace(problem.log, indentation_mm=None))
    modelled = alone.of(grid[0].ravel(), grid[1].ravel()).modelled(vector)
    sd, shares = sd_and_shares(modelled.values - problem.each("zero_microstrain", problem.values(vector)))
    # d ln S_d / d reading = shares / S_d
    by = shares / sd[:, None]
    return np.einsum("mg,mgf->mf", by, modelled.by_free), (by * modelled.by_ln_modulus).sum(axis=1)


def narrowing_press(known: Identification, name: str) -> tuple[float, float, float]:
    """Force (N) and modulus (MPa) of the press at the apex, on a specimen of the log, that would determine a parameter
    best; and the parameter's standard deviation after it, in the scale of the fit."""
    problem, ranges = known.problem, CalibrationRanges.of(known.problem.finger)
    grid = np.meshgrid(ranges.forced(SUGGESTED_FORCES_N), np.unique(problem.log.modulus_MPa))
    forces, moduli = (axis.ravel() for axis in grid)
    jacobian = problem.jacobian(known.vector)
    further = _finger(problem, known.vector, (forces, moduli, np.zeros((len(forces), 2))), jacobian.T @ jacobian)
    place = known.names.index(name)
    after = np.linalg.inv(further.known + further.each)[:, place, place]
    best = int(np.argmin(after))
    # Sigmas of a fit that does not fit are wider than the information says
    share = np.sqrt(after[best] / np.linalg.inv(further.known)[place, place])
    return float(forces[best]), float(moduli[best]), float(share * known.sigma[place])


def _pressed(problem: Problem, vector: np.ndarray, presses: Presses) -> Problem:
    """The problem of other presses on a finger, whose measurements and weights follow from its vector (f,)."""
    empty, alone = problem.of(*presses), problem.log.stated_sd is not None
    if alone:
        nothing = np.zeros((len(presses[0]), 0))
        empty = replace(empty, log=replace(empty.log, readings=nothing, gauge_names=(), stated_sd=presses[0]))
    read = empty.modelled(vector).values
    measured: dict = {"stated_sd": read[:, 0]} if alone else {"readings": read[:, : len(problem.gauges)]}
    return replace(empty, log=replace(empty.log, **measured), robust=np.ones(read.shape)).weighted(vector)


def _score(fingers: list[_Finger], rows: list[int], criterion: Criterion) -> np.ndarray:
    """The criterion (n,), lower is better, with each candidate added to the chosen rows."""
    total = np.zeros(len(fingers[0].each))
    for finger in fingers:
        information = finger.known + finger.each[rows].sum(axis=0) + finger.each
        total = total + (-np.linalg.slogdet(information)[1] if criterion == "D" else finger.log_variance(information))
    return total


def _greedy(fingers: list[_Finger], count: int, criterion: Criterion) -> list[int]:
    rows: list[int] = []
    for _ in range(count):
        rows.append(int(np.argmin(_score(fingers, rows, criterion))))
    return rows


def _exchanged(fingers: list[_Finger], rows: list[int], criterion: Criterion) -> list[int]:
    """The presses after exchanging one after another for better candidates (Fedorov), until there are none."""
    for _ in range(MOST_PRESS_EXCHANGES):
        before = list(rows)
        for k in range(len(rows)):
            others = rows[:k] + rows[k + 1 :]
            scores = _score(fingers, others, criterion)
            best = int(np.argmin(scores))
            # Equal scores within rounding change nothing, or two equal candidates would take turns for ever.
            if scores[best] < scores[rows[k]] - checks.ROUNDING_SHARE:
                rows = [*others[:k], best, *others[k:]]
        if rows == before:
            break
    return rows
