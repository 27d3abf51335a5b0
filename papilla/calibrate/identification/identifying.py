"""`identify`: states the problem of a log of presses, fits it, and frees further parameters if the presses do not fit
otherwise."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from papilla.calibrate.identification.fit import MISFIT, Identification, solve, solved_from
from papilla.calibrate.identification.noise import Noise
from papilla.calibrate.identification.parameters import MOVES, PARAMETERS, checked_values, kind, linear_last, names_of
from papilla.calibrate.identification.posing import ensure_physics, family_of, problem_of, with_moves
from papilla.calibrate.identification.presses import refuse_far
from papilla.calibrate.identification.problem import Problem
from papilla.errors import InputError
from papilla.finger import Finger
from papilla.logs import PressLog
from papilla.specimen import Friction, Specimen

MOST_FREED = 2
"""Largest number of parameters that are freed in this way: with more, the fit would only absorb other errors."""

LEAST_FALL = 0.3
"""Share by which each freed parameter must lower chi-square."""

TRIED = 3
"""Number of likely parameters of which each is tried."""

ALIKE = 3.84
"""Difference of chi-square up to which two parameters explain the presses equally well: the 95 % quantile for one
degree of freedom."""


def identify(
    log: PressLog,
    finger: Finger,
    *,
    free: Sequence[str] = (),
    fix: Mapping[str, float] | None = None,
    specimen: Specimen | None = None,
    noise: Noise | None = None,
    friction: Friction | None = None,
    size_mm: float | None = None,
    processes: int = 1,
    progress: Callable[[str], None] | None = None,
) -> Identification:
    """Identify a finger of known geometry from presses on specimens of known modulus.

    Places of gauges and tilt are held unless `free` names them. If the model does not fit the presses, but fits with
    one or two of them free, these are freed, and the identification says so (`asked`).

    Parameters
    ----------
    finger : geometry and Poisson's ratios; its moduli are the middle of their priors.
    free : names of `PARAMETERS` to fit besides both moduli, gains, levers, zeros, and the touch-down offset where there
        are indentations. fix : values (in their units) at which parameters are held.
    specimen : what was pressed, if the log does not say it; its modulus is ignored. noise : of the presses. friction :
        as for `papilla.fem.press`. If they are None, those of the finger's `bench` are taken.
    size_mm : elements at the contact. processes : number of processes that measure large strain at the same time, if it
        is not known.

    Raises `InputError` for a log of another finger, of presses far from the apex, unknown names, or fewer measurements
    than a fit needs, and what `papilla.fem.reduction.family.family` raises.
    """
    if processes > 1:
        rubbing = finger.bench.friction if friction is None else friction
        ensure_physics(finger, rubbing, processes=processes, progress=progress)
    problem = problem_of(log, finger, free, fix or {}, specimen, noise, friction, size_mm, progress)
    held = checked_values(fix or {}, finger)
    return freed(solve(problem, progress), tuple(held), size_mm, progress)


def freed(
    found: Identification, held: tuple[str, ...], size_mm: float | None, progress: Callable[[str], None] | None
) -> Identification:
    """The identification after freeing further parameters, if the model did not fit before and fits then.

    held : parameters that must not be freed.
    """
    if not _misfit(found) or found.problem.log.stated_sd is not None:
        return found
    try:
        best = replace(found, problem=_moving(found.problem, size_mm, progress))
    except InputError:
        return found  # Neither contacts nor gauges of this finger can be moved that far
    names: list[str] = []
    alike: list[str] = []
    while _misfit(best) and len(names) < MOST_FREED:
        # Score test first: a whole fit for each candidate would take minutes.
        gains = {name: _gain(best, name) for name in _candidates(best.problem, held)}
        likely = sorted(gains, key=lambda name: -gains[name])[:TRIED]
        if progress is not None:
            progress(f"the model does not fit: with {', '.join(likely) or 'nothing more'} free")
        tried = {name: _with_free(best, name) for name in likely}
        name = min(tried, key=lambda one: tried[one].chi_square, default="")
        if not name or tried[name].chi_square > (1 - LEAST_FALL) * best.chi_square:
            break
        best = tried.pop(name)
        names.append(name)
        alike = [one for one in tried if tried[one].chi_square < best.chi_square + ALIKE]
    # Only if the model then fits: otherwise the freed parameter would only hide another error.
    if not names or _misfit(best):
        return found
    named = " and ".join(f"{name} ({best[name][0]:+.2g} {PARAMETERS[kind(name)].unit})" for name in names)
    fell = f"chi-square fell from {found.chi_square:.3g} to {best.chi_square:.3g}"
    others = f"; {' or '.join(alike)} instead of {names[-1]} does as well" if alike else ""
    return replace(best, asked=f"{named} was freed because the presses do not fit otherwise: {fell}{others}")


def _with_free(found: Identification, name: str) -> Identification:
    """The fit with one more parameter free, started from the earlier fit."""
    free = linear_last((*found.names, name))
    at = dict(zip(found.names, found.vector.tolist(), strict=True))
    return solved_from(replace(found.problem, free=free), np.array([at.get(one, 0.0) for one in free]))


def _misfit(found: Identification) -> bool:
    return found.freedom > 0 and found.chi_square > MISFIT * found.freedom


def _moving(problem: Problem, size_mm: float | None, progress: Callable[[str], None] | None) -> Problem:
    """The problem with the changes by contacts beside the apex and by moved gauges."""
    if all(shape.off_apex is not None for shape in problem.shapes):
        return problem
    relatives = family_of(problem.finger, size_mm=size_mm, progress=progress)
    return replace(problem, shapes=with_moves(problem.shapes, relatives, progress))


def _candidates(problem: Problem, held: tuple[str, ...]) -> list[str]:
    """Places and tilts that are neither free nor held, and that these presses could determine."""
    found = []
    for name in names_of(problem.finger):
        if kind(name) not in MOVES or name in problem.free or name in held:
            continue
        off_apex = problem.shapes[0].off_apex
        assert off_apex is not None
        flat = all(shape.specimen.curvature == (0.0, 0.0) for shape in problem.shapes)
        try:
            refuse_far(problem.log, off_apex.limits, (*problem.free, name))
        except InputError:
            continue
        if flat or not name.startswith("tilt"):
            found.append(name)
    return found


def _gain(found: Identification, name: str) -> float:
    """Fall of chi-square plus priors with one more parameter free, to first order (Rao's score test)."""
    problem = replace(found.problem, free=(*found.names, name))
    vector = np.append(found.vector, 0.0)
    residuals, jacobian = problem.residuals(vector), problem.jacobian(vector)
    others = np.linalg.qr(jacobian[:, :-1])[0]
    column = jacobian[:, -1] - others @ (others.T @ jacobian[:, -1])
    size = float(column @ column)
    return float(column @ residuals) ** 2 / size if size > 0 else 0.0
