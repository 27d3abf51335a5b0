"""The path of a press: finger and specimen from first touch on, as the force grows, at a given friction.

The effect of friction depends on how the force was reached. Here it grows from nothing along the contact normal, and a
node keeps, while it sticks, the relative tangential displacement that it had at the moment of contact (Spence 1968,
doi:10.1098/rspa.1968.0105). Without friction and with full stick the path is that of `contact_path`, exact. With
Coulomb's law a step ends at the indentation where the next node should come into contact, and is solved exactly. If
nodes leave the contact again, one step solves each load without friction, and stick is computed as Coulomb friction
with a coefficient that no force overcomes.
"""

import math
from contextlib import suppress
from dataclasses import replace

import numpy as np

from papilla.errors import SolverError
from papilla.fem.pressing.contact_path import ContactPath, ContactProblem, ContactState, LeavingError
from papilla.fem.pressing.contact_step import StepState, contact_step, first_touch, rates
from papilla.fem.reduction.patch import weak_gap
from papilla.fem.reduction.reduced import ReducedFinger, kept
from papilla.specimen import Specimen

ORDER_STEP = 1.0
"""Step of ln modulus between paths that are kept; other paths begin with their order of nodes."""

LONGEST = 0.1
"""Longest step of Coulomb friction, as a share of the indentation since first touch."""

FIRST = 1e-3
"""First step, in widths of the patch, if all nodes touch at once so that no distance between contacts gives a
length."""

TOGETHER = 1e-9
"""Share of the indentation since first touch within which nodes count as coming into contact together."""

SHORTEST = 2.0**-12
"""Smallest share of its length to which a step is cut if it does not converge."""

ROUGH = 1e9
"""Coefficient of friction that stands for stick."""

PLAIN_MARGIN, STUCK_MARGIN = 1.2, 1.05
"""Factors by which a path without friction and a stuck one are computed further than needed: the nodes of the stuck one
are guessed from the path without friction, whose forces differ by up to 2 %."""


def loading_path(reduced: ReducedFinger, specimen: Specimen, friction: float) -> "LoadingPath":
    """The path of a finger and specimen with Coulomb's coefficient, 0 for none, infinite for stick.

    The path is kept, so that the presses of a sweep share it. Raises `InputError` if the tangential compliance of a
    specimen does not agree with its normal compliance.
    """
    return _rubbing_path(reduced, specimen, friction) if friction else _plain_path(reduced, specimen)


@kept(64)
def _plain_path(reduced: ReducedFinger, specimen: Specimen) -> "LoadingPath":
    """The path without friction. Its first order of nodes is that of a path at a similar modulus."""
    patch, guess = reduced.patch, None
    if specimen.elastic:
        # Moduli are rounded to a grid in ln E: a sweep solves a new order at some of them, and the others start from
        # it.
        near = replace(specimen.unit, modulus=math.exp(ORDER_STEP * round(math.log(specimen.modulus) / ORDER_STEP)))
        guess = _plain_path(reduced, near).whole if near != specimen else None
    compliance = reduced.compliance + reduced.specimen_compliance(specimen)
    return LoadingPath(ContactProblem(compliance, patch.mass, weak_gap(patch, specimen.unit)), 0.0, guess)


@kept(8)
def _rubbing_path(reduced: ReducedFinger, specimen: Specimen, friction: float) -> "LoadingPath":
    patch = reduced.patch
    compliance = reduced.traction_compliance + reduced.specimen_traction_compliance(specimen)
    fixed = ((patch.xy == 0) & (patch.images < 0).any(axis=0)).T
    problem = ContactProblem(compliance, patch.mass, weak_gap(patch, specimen.unit), fixed)
    return LoadingPath(problem, friction, _plain_path(reduced, specimen).whole)


class LoadingPath:
    """States of growing indentation with Coulomb's coefficient, 0 for none, infinite for stick; computed as far as
    needed, and kept.

    whole : the exact path of a contact that only grows; None with Coulomb's law. knots : the states found by steps.
    guess : the path of a similar problem on the same nodes, or of this one without friction, whose order is tried
    first.
    """

    def __init__(self, problem: ContactProblem, friction: float, guess: ContactPath | None = None):
        self.problem, self.friction = problem, min(friction, ROUGH)
        margin = {0.0: PLAIN_MARGIN, ROUGH: STUCK_MARGIN}.get(self.friction)
        self.whole = ContactPath(problem, guess, margin) if margin else None
        self.knots = [first_touch(problem)]
        self._idle = 0

    def words(self, state: ContactState) -> str:
        """Words for the status of a press, which describe a state."""
        touching = int(state.active.sum())
        if not self.friction:
            return f"{touching} nodes in contact"
        if self.whole is not None:
            return f"stuck from the moment of contact, the force grown from first touch in {touching} steps"
        assert isinstance(state, StepState)
        steps = sum(knot.indentation < state.indentation for knot in self.knots)
        slips = f"{state.slipping.sum()} of {touching} nodes slip"
        return f"friction {self.friction:g}: {slips}, the force grown from first touch in {steps} steps"

    def at(self, *, force: float | None = None, indentation: float | None = None) -> ContactState | None:
        """The state at a force on the patch (N) or an indentation (mm); it does not depend on what was computed before.
        None before first touch. Raises `SolverError` if a step does not converge."""
        if self.whole is not None:
            with suppress(LeavingError):
                return self.whole.at(force=force, indentation=indentation)
        name, aim = ("force", force) if force is not None else ("indentation", indentation)
        assert aim is not None
        if aim <= getattr(self.knots[0], name):
            return None
        if not self.friction:
            return contact_step(self.problem, self.knots[0], force=force, indentation=indentation)
        # Coulomb's law depends on the path: extend it knot by knot, then solve the asked state from the knot before it,
        # so that the answer does not depend on earlier questions.
        while getattr(self.knots[-1], name) < aim:
            self._extend()
        k = next(k for k, knot in enumerate(self.knots) if getattr(knot, name) >= aim)
        before, after = self.knots[k - 1], self.knots[k]
        share = (aim - getattr(before, name)) / (getattr(after, name) - getattr(before, name))
        traction = before.traction + share * (after.traction - before.traction)
        return contact_step(self.problem, before, self.friction, force=force, indentation=indentation, guess=traction)

    def _extend(self) -> None:
        """Add one step, up to the indentation where the next node comes into contact."""
        state = self.knots[-1]
        rate = rates(self.problem, state, self.friction)
        length, node = _next_event(self.problem, state, rate)
        sunk = state.indentation - self.knots[0].indentation
        length = 0.0 if length <= TOGETHER * sunk else length
        # Nodes that come into contact together need steps of no length; too many of them in a row mean a cycle.
        self._idle = 0 if length > 0 else self._idle + 1
        if self._idle > 3 * len(self.problem.mass):
            raise SolverError("nodes keep entering and leaving the contact: no state of stick follows this one")
        if not math.isfinite(length) or 0 < LONGEST * sunk < length:
            length, node = LONGEST * sunk or FIRST * math.sqrt(self.problem.mass.sum()), None
        if length > 0:
            self.knots.append(self._coulomb(state, length, rate))
        if node is not None:
            self.knots[-1] = replace(self.knots[-1], active=self.knots[-1].active | (np.arange(len(rate[0])) == node))

    def _coulomb(self, state: StepState, length: float, rate: np.ndarray) -> StepState:
        """The state `length` (mm) further, in as many shorter steps as needed."""
        done, cut = 0.0, 1.0
        while done < 1:
            depth, guess = state.indentation + cut * length, state.traction + cut * length * rate
            try:
                state = contact_step(self.problem, state, self.friction, indentation=depth, guess=guess)
                done += cut
            except SolverError:
                cut /= 2
                if cut < SHORTEST:
                    raise
        return state


def _next_event(problem: ContactProblem, state: StepState, rate: np.ndarray) -> tuple[float, int | None]:
    """Distance (mm), at given rates, until the next node comes into contact, and that node; infinity and None if there
    is none."""
    # Gaps and their rates of closing are linear in the step, as long as no node changes its set.
    gap = state.moved[0] + problem.gap - state.indentation * problem.mass
    closing = problem.moved(rate)[0] - problem.mass
    entering = ~state.active & (closing < 0)
    lengths = np.full(len(gap), np.inf)
    lengths[entering] = np.maximum(gap[entering], 0) / -closing[entering]
    node = int(np.argmin(lengths))
    return (float(lengths[node]), node) if np.isfinite(lengths[node]) else (math.inf, None)
