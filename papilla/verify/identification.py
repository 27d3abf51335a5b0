"""The fit of a finger and its profiles compared with Minuit, which gets the same objective and nothing else."""

from collections.abc import Iterator

import numpy as np

from papilla.core import settings
from papilla.core.errors import MissingExtraError
from papilla.core.units import STRAIN_PER_MICROSTRAIN
from papilla.fem.pressing.response import Response, response
from papilla.identification import Identification, identify
from papilla.identification.posing import family_of
from papilla.identification.problem import Problem
from papilla.identification.profile import INTERVAL_HALF_WIDTH_SIGMAS, profile
from papilla.logs import PressLog
from papilla.model.finger import Finger
from papilla.model.specimen import STICK_WORD, Block
from papilla.verify.case import Case

FIT_CASES = settings.parameters(__name__)


def identification() -> Iterator[Case]:
    """Smallest chi-square and its place, the 95 % ends of both moduli's profiles and their verdicts, from three
    logs."""
    try:
        import iminuit  # noqa: F401
    except ImportError as error:
        raise MissingExtraError("iminuit is not installed; pip install 'papilla[peers]'") from error
    finger = Finger.default()
    smooth = response(family_of(finger, size_mm=FIT_CASES.size_mm), Block(1.0, 10.0))
    for seed, (name, presses) in enumerate(FIT_CASES.logs.items(), start=1):
        log = _log(smooth, np.random.default_rng(seed), **presses)
        yield from _against_minuit(name, identify(log, finger, size_mm=FIT_CASES.size_mm, friction=STICK_WORD))


def _log(smooth: Response, rng: np.random.Generator, forces_N, moduli_MPa, deep: bool) -> PressLog:
    """Presses of a randomly drawn finger, with the noise that `identify` assumes."""
    drawn, gauges = FIT_CASES.drawn, 5
    outer, inner = (
        middle * np.exp(rng.uniform(-ln, ln))
        for middle, ln in ((drawn.outer_MPa, drawn.outer_ln), (drawn.inner_MPa, drawn.inner_ln))
    )
    gain = np.exp(rng.uniform(np.log(drawn.least_gain), 0, gauges)) * rng.choice([-1, 1], gauges)
    least, most = drawn.lever
    lever = gain * rng.uniform(least, most, gauges)
    zero = rng.uniform(-drawn.zero_microstrain, drawn.zero_microstrain, gauges)
    force, modulus = (values.ravel() for values in np.meshgrid(forces_N, moduli_MPa))
    felt = smooth.felt(force * (1 + drawn.force_noise * rng.normal(size=force.size)), modulus, outer, inner)
    readings = (gain * felt.values[:, 0] + lever * felt.values[:, 1]) / STRAIN_PER_MICROSTRAIN + zero
    readings += drawn.noise_microstrain * rng.normal(size=readings.shape)
    depth = felt.indentation + drawn.depth_zero_mm + drawn.depth_noise_mm * rng.normal(size=force.size)
    names = tuple(f"g{number + 1}" for number in range(gauges))
    return PressLog(force, modulus, readings, names, depth if deep else None)


def _against_minuit(name: str, identified: Identification) -> Iterator[Case]:
    problem, vector = identified.problem, identified.vector
    begun = vector + 0.5 * identified.sigma * np.random.default_rng(0).normal(size=len(vector))
    second = _minuit(problem, begun, identified.sigma).migrad()
    least = float((problem.residuals(vector) ** 2).sum())
    yield Case(
        f"least chi-square, {name}",
        "above what Minuit's migrad comes to",
        max(0.0, least - second.fval),
        FIT_CASES.same_cost,
    )
    away = np.abs((np.array(second.values) - vector) / identified.sigma).max()
    yield Case(f"parameters, {name}", "largest distance to Minuit's, in sigma", float(away), FIT_CASES.same_sigmas)
    ends, verdicts = [], 0
    for place in np.flatnonzero(~problem.linear):
        parameter = identified.names[place]
        ours = profile(identified, parameter)
        second.minos(parameter, cl=FIT_CASES.confidence)
        error, middle = second.merrors[parameter], second.values[parameter]
        # If a prior limits the interval there are side valleys, and minos stays in its valley.
        if ours.verdict == "bounded" and not ours.cut_off_by:
            # Minos itself reports a missing end.
            sides = (ours.lower, error.lower, error.lower_valid), (ours.upper, error.upper, error.upper_valid)
            ends += [abs(np.log(end) - middle - by) / identified.sigma[place] for end, by, valid in sides if valid]
        verdicts += ours.verdict != _verdict(problem, identified, parameter)
    if ends:
        against = "largest distance to Minuit's minos, in sigma"
        yield Case(f"95 % ends of profiles, {name}", against, max(ends), FIT_CASES.same_sigmas)
    what = "profiles whose verdict is not that of Minuit at the bounds, without the prior"
    yield Case(f"verdicts of profiles, {name}", what, float(verdicts), 0.0)


def _minuit(problem: Problem, start: np.ndarray, step: np.ndarray, without_prior_of: str | None = None):
    """Minuit on the chi-square of a problem, with all parameters treated alike, in the scale of the fit."""
    from iminuit import Minuit

    with_prior = np.array([name != without_prior_of for name in (*problem.free, "the ratio of the moduli")])
    rows = np.concatenate([np.ones(problem.measured.size, bool), with_prior])

    def chi_square(vector: np.ndarray) -> float:
        return float((problem.residuals(vector)[rows] ** 2).sum())

    def gradient(vector: np.ndarray) -> np.ndarray:
        return 2 * problem.jacobian(vector)[rows].T @ problem.residuals(vector)[rows]

    minimizer = Minuit(chi_square, start, grad=gradient, name=problem.free)
    minimizer.errordef, minimizer.strategy, minimizer.tol = (
        Minuit.LEAST_SQUARES,
        FIT_CASES.strategy,
        FIT_CASES.tolerance,
    )
    minimizer.errors = step
    sides = zip(*problem.bounds, problem.linear, strict=True)
    minimizer.limits = [(None, None) if linear else (low, high) for low, high, linear in sides]
    return minimizer


def _verdict(problem: Problem, identified: Identification, name: str) -> str:
    """The verdict by Minuit, for the presses without the parameter's prior: chi-square at its bounds compared with the
    minimum."""
    place = identified.names.index(name)
    costs = []
    for value in (None, *(side[place] for side in problem.bounds)):
        start = identified.vector.copy()
        start[place] = start[place] if value is None else value
        minimum = _minuit(problem, start, identified.sigma, without_prior_of=name)
        minimum.fixed[name] = value is not None
        costs.append(minimum.migrad().fval)
    return ("flat", "one-sided", "bounded")[
        sum(cost - min(costs) > INTERVAL_HALF_WIDTH_SIGMAS**2 for cost in costs[1:])
    ]
