"""Presses with friction between finger and specimen: points on the path of a force that grows from first touch.

What friction does depends on how the force was reached. Here it grows from nothing along the contact normal, and a node
keeps, while it sticks, the relative tangential displacement that it had when it came into contact (Spence 1968,
doi:10.1098/rspa.1968.0105), not that of the undeformed bodies. With full stick everything is linear in the indentation
between one node's coming into contact and the next one's, so that the path of the condensed bodies is exact. With
Coulomb's law a step ends where the next node is expected, and is solved exactly.
"""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from papilla.errors import InputError, SolverError
from papilla.fem.pressing.contact import NoContactError, contact_result
from papilla.fem.pressing.friction_step import FrictionProblem, FrictionState, coulomb_step, rates
from papilla.fem.pressing.press import Press, refuse_detail
from papilla.fem.reduction.compliance import weak_gap
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.specimen import Specimen

UNLIKE = 1e-6
"""Difference, as a share of the largest, between the two compliances that a specimen gives for pressure alone."""

LONGEST = 0.1
"""Longest step of Coulomb friction, as a share of the indentation since first touch."""

FIRST = 1e-3
"""First step, in widths of the patch, where all nodes touch at once and none marks a length."""

TOGETHER = 1e-9
"""Share of the indentation since first touch within which nodes come into contact together."""

SHORTEST = 2.0**-12
"""Share of its length down to which a step that does not settle is cut."""


def friction_press(
    reduced: ReducedFinger,
    specimen: Specimen,
    force: float | None,
    indentation: float | None,
    friction: float,
    began: float,
) -> Press:
    """One press by force (N) or indentation (mm) with a coefficient of friction > 0, infinite for stick.

    The finger is pushed along the contact normal, and held sideways. Raises `ContactRangeError` as `contact_press`
    does, `InputError` for a specimen whose tangential compliance does not fit its normal one.
    """
    refuse_detail(specimen, reduced.patch, reduced.mesh_size_mm)
    path = friction_path(reduced, specimen, friction)
    share = None if force is None else force / reduced.multiplicity
    state = path.at(force=share, indentation=indentation)
    if state is None:
        raise NoContactError(f"an indentation of {indentation:g} mm makes no contact on this mesh: it is too coarse")
    taken = sum(knot.indentation < state.indentation for knot in path.knots)
    held = f"friction {friction:g}: {state.slipping.sum()} of {state.active.sum()} nodes slip"
    if math.isinf(friction):
        held = "stuck from the moment of contact"
    return contact_result(
        reduced,
        specimen,
        began,
        force=force,
        pressure=state.traction[0],
        indentation=state.indentation,
        active=state.active,
        values=reduced.traction_rows @ state.traction.ravel(),
        status=f"contact: {held}, the force grown from first touch in {taken} steps",
        shear=state.traction[1:],
        friction=friction,
    )


@lru_cache(maxsize=8)
def friction_path(reduced: ReducedFinger, specimen: Specimen, friction: float) -> "FrictionPath":
    """The path of one finger, specimen and coefficient; kept, so that the presses of a sweep share it."""
    patch = reduced.patch
    theirs = reduced.specimen_traction_compliance(specimen)
    n, normal = len(patch.xy), reduced.specimen_compliance(specimen)
    if np.abs(theirs[:n, :n] - normal).max() > UNLIKE * normal.max():
        raise InputError(
            f"{specimen.words}: traction_compliance, which friction needs, does not fit compliance: override both"
        )
    fixed = ((patch.xy == 0) & (patch.images < 0).any(axis=0)).T
    problem = FrictionProblem(reduced.traction_compliance + theirs, patch.mass, weak_gap(patch, specimen), fixed)
    return FrictionPath(problem, friction)


class FrictionPath:
    """States of growing indentation of a problem with one friction; made as far as asked for, and kept.

    `friction` is Coulomb's coefficient, or infinite for full stick.
    """

    def __init__(self, problem: FrictionProblem, friction: float):
        self.problem, self.friction = problem, friction
        first = int(np.argmin(problem.gap / problem.mass))
        nothing, active = np.zeros((3, len(problem.mass))), np.arange(len(problem.mass)) == first
        depth = float(problem.gap[first] / problem.mass[first])
        self.knots = [FrictionState(depth, 0.0, 0.0, nothing, nothing, active, np.zeros_like(active))]
        self._idle = 0

    def at(self, *, force: float | None = None, indentation: float | None = None) -> FrictionState | None:
        """The state at a force on the patch (N) or an indentation (mm), whatever was asked for before; None before
        first touch. Raises `SolverError` where a step does not settle."""
        name, aim = ("force", force) if force is not None else ("indentation", indentation)
        assert aim is not None
        if aim <= getattr(self.knots[0], name):
            return None
        while getattr(self.knots[-1], name) < aim:
            self._extend()
        k = next(k for k, knot in enumerate(self.knots) if getattr(knot, name) >= aim)
        before, after = self.knots[k - 1], self.knots[k]
        share = (aim - getattr(before, name)) / (getattr(after, name) - getattr(before, name))
        depth = before.indentation + share * (after.indentation - before.indentation)
        traction = before.traction + share * (after.traction - before.traction)
        if math.isinf(self.friction):
            return _reached(self.problem, before, depth, traction)
        return coulomb_step(self.problem, before, self.friction, force=force, indentation=indentation, guess=traction)

    def _extend(self) -> None:
        """One event more: up to where the next node comes into contact, or leaves it."""
        state, stuck = self.knots[-1], math.isinf(self.friction)
        rate = _stuck_rates(self.problem, state.active) if stuck else rates(self.problem, state, self.friction)
        length, node = _next_event(self.problem, state, rate, leaving=stuck)
        sunk = state.indentation - self.knots[0].indentation
        length = 0.0 if length <= TOGETHER * sunk else length
        self._idle = 0 if length > 0 else self._idle + 1
        if self._idle > 3 * len(self.problem.mass):
            raise SolverError("nodes come and go without end: no state of stick follows this one")
        if not math.isfinite(length) or (not stuck and 0 < LONGEST * sunk < length):
            length, node = LONGEST * sunk or FIRST * math.sqrt(self.problem.mass.sum()), None
        if length > 0 and stuck:
            traction = state.traction + length * rate
            self.knots.append(_reached(self.problem, state, state.indentation + length, traction))
        elif length > 0:
            self.knots.append(self._coulomb(state, length, rate))
        if node is not None and state.active[node]:
            self.knots[-1] = _released(self.problem, self.knots[-1], node)
        elif node is not None:
            self.knots[-1] = replace(self.knots[-1], active=self.knots[-1].active | (np.arange(len(rate[0])) == node))

    def _coulomb(self, state: FrictionState, length: float, rate: np.ndarray) -> FrictionState:
        """The state `length` (mm) on, in as many cuts as it takes."""
        done, cut = 0.0, 1.0
        while done < 1:
            depth, guess = state.indentation + cut * length, state.traction + cut * length * rate
            try:
                state = coulomb_step(self.problem, state, self.friction, indentation=depth, guess=guess)
                done += cut
            except SolverError:
                cut /= 2
                if cut < SHORTEST:
                    raise
        return state


def _next_event(problem: FrictionProblem, state: FrictionState, rate: np.ndarray, *, leaving: bool):
    """How far (mm) it is to the next change of contact along given rates, and the node that changes; or inf, None."""
    gap = state.moved[0] + problem.gap - state.indentation * problem.mass
    closing = problem.moved(rate)[0] - problem.mass
    entering = ~state.active & (closing < 0)
    lengths = np.full(len(gap), np.inf)
    lengths[entering] = np.maximum(gap[entering], 0) / -closing[entering]
    if leaving:
        falling = state.active & (rate[0] < 0)
        lengths[falling] = np.maximum(state.traction[0, falling], 0) / -rate[0, falling]
    node = int(np.argmin(lengths))
    return (float(lengths[node]), node) if np.isfinite(lengths[node]) else (math.inf, None)


def _reached(problem: FrictionProblem, state: FrictionState, depth: float, traction: np.ndarray) -> FrictionState:
    """A state further on with the same nodes in contact, none of which slipped."""
    moved = problem.moved(traction)
    return replace(state, indentation=depth, force=problem.force(traction), traction=traction, moved=moved)


def _released(problem: FrictionProblem, state: FrictionState, node: int) -> FrictionState:
    """The same state with one node less in contact: what it held back the others take over."""
    active = state.active & (np.arange(len(state.active)) != node)
    traction, index = state.traction.copy(), np.flatnonzero(problem.free & active)
    traction[:, node] = 0
    lost = problem.moved(state.traction - traction).ravel()[index]
    traction.ravel()[index] += _cholesky_solve(problem, index, lost)
    return replace(_reached(problem, state, state.indentation, traction), active=active)


def _stuck_rates(problem: FrictionProblem, active: np.ndarray) -> np.ndarray:
    """Tractions (3, n) per mm of indentation while all nodes in contact stick."""
    index = np.flatnonzero(problem.free & active)
    right = np.zeros(len(index))
    right[: int(active.sum())] = problem.mass[active]
    rate = np.zeros((3, len(active)))
    rate.ravel()[index] = _cholesky_solve(problem, index, right)
    return rate


def _cholesky_solve(problem: FrictionProblem, index: np.ndarray, right: np.ndarray) -> np.ndarray:
    factor, failed = dpotrf(problem.compliance[np.ix_(index, index)].T, lower=True, overwrite_a=True, clean=False)
    if failed:
        raise SolverError("the compliance is not positive: an unstable finger, or a mesh too coarse for the specimen")
    return dpotrs(factor, right, lower=True)[0]
