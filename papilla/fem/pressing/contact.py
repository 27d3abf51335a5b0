"""The `contact` fidelity: unilateral contact on the condensed finger, with contact area and peak pressure.

Tractions and indentation are a state of the `loading_path` of finger and specimen from first touch on, because the
effect of friction depends on how the force was reached. The force grows along the contact normal, and a node keeps,
while it sticks, the relative tangential displacement that it had at the moment of contact (Spence 1968,
doi:10.1098/rspa.1968.0105). Without friction and with full stick the path is that of `contact_path`, exact. Coulomb's
law takes the steps of `contact_step`, as does a contact that nodes leave again: in one step without friction, or with a
coefficient that no force overcomes, which stands for stick.

The nodes alone give area and peak pressure poorly, so an ellipse corrects them in two ways.

Moments of the nodal pressure determine a Hertz profile with one more term for layers (`ellipses`); area and peak
pressure are those of that profile. If no such profile has these moments, the area is the sum over the nodes in contact.

A contact that is only a few elements wide also has an error in indentation and readings. There the ellipse of least
energy (`hertz`), which needs no nodes, is mixed in with the weight

  w = 1 / (1 + (n / 5)^10),    n = elements across the contact radius.

Measured against an axisymmetric reference, the error of the nodes falls with n and that of the ellipse grows with the
contact; at n = 5 they are equal (docs/adr/0018).
"""

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from papilla.core.errors import ContactRangeError
from papilla.core.units import PER_CENT
from papilla.fem.pressing import ellipses
from papilla.fem.pressing.contact_path import ContactPath, ContactProblem, ContactState, LeavingError
from papilla.fem.pressing.contact_step import SteppedPath, StepState
from papilla.fem.pressing.hertz import hertz_scene
from papilla.fem.pressing.press import CONTACT_MEASURES, Load, Press, linear_press, refuse_detail, too_coarse
from papilla.fem.reduction.patch import Patch, quadrature, weak_gap
from papilla.fem.reduction.reduced import ReducedFinger, kept
from papilla.model.specimen import Specimen

ORDER_STEP = 1.0
"""Step of ln modulus between paths that are kept; other paths begin with their order of nodes."""

ROUGH_FRICTION = 1e9
"""Coefficient of friction that stands for stick."""

PLAIN_MARGIN, STUCK_MARGIN = 1.2, 1.05
"""Factors by which a path without friction and a stuck one are computed further than needed: the nodes of the stuck one
are guessed from the path without friction, whose forces differ by up to 2 %."""

OFF_APEX = 0.05
"""Accuracy of the readings, as a share of the largest, at a touch-down point other than the apex, for which the mesh is
made: two meshes differ by up to 4.6 % there (`papilla verify --only places`)."""

SAME_ELLIPSE = 0.1
"""If the area differs from that of the `hertz` fidelity by less than this share, the contact uses the layer term of
`hertz`."""

TRUSTED_MISMATCH, TRUSTED_COARSE_MISMATCH = 0.05, 40.0
"""Mismatch of the sixth moment above which the contact is not an ellipse (for example a slab's line contact). The
second number holds for one element across the radius and falls with the fourth power of their number (0.12 was measured
at 4.8)."""

CUT_OFF_PRESSURE_SHARE = 0.01
"""Share of the peak pressure: a larger pressure at the patch's outline means that the outline cuts the contact off."""

INNER_SQUARED_RADIUS = 1.25
"""Squared radius, relative to its mean under the pressure, inside of which the pressure determines its profile: half of
the contact. The outer half depends too much on the mesh, and there the profiles of layers leave the family."""

TELLING_ELEMENTS, RESOLVING_ELEMENTS = 4.0, 6.0
"""Elements across the contact radius from which the pressure determines q better than Hertz's q = 0 does, and better
than the least energy does."""

EDGE_BAND = 1.2
"""Largest difference between the area of an ellipse and the area that belongs to the pressed nodes. Its unit is the
area of the strip at the contact's edge: all triangles at pressed nodes, less the nodes' own area. True ellipses stay
below 0.93; a square, whose low moments an ellipse can match, gives 1.5 or more."""

EQUAL_ELEMENTS, WEIGHT_STEEPNESS = 5, 10
"""Elements across the radius at which ellipse and nodes have equal weight, and the power of n in the weight."""

NEGLIGIBLE_WEIGHT = 0.01
"""Smallest weight for which the ellipse is computed."""

SAME_CONTACT = {"contact_area": 0.1, "indentation": 0.03}
"""Differences of area and indentation between ellipse and nodes up to which both describe the same contact: nodes are
off by up to 4 and 0.6 %."""


class NoContactError(ContactRangeError):
    """The indentation is less than the gap at the first node of the mesh."""


def loading_path(reduced: ReducedFinger, specimen: Specimen, friction: float) -> "LoadingPath":
    """The path of a finger and specimen with Coulomb's coefficient, 0 for none, infinite for stick.

    The path is kept, so that the presses of a sweep share it. Raises `InputError` if the tangential compliance of a
    specimen does not agree with its normal compliance.
    """
    return _rubbing_path(reduced, specimen, friction) if friction else _plain_path(reduced, specimen)


@kept(64)
def _plain_path(reduced: ReducedFinger, specimen: Specimen) -> "LoadingPath":
    """The path without friction. Its first order of nodes is that of a path at a similar modulus."""
    guess = None
    if specimen.elastic:
        # Moduli are rounded to a grid in ln E: a sweep solves a new order at some of them, and the others start from
        # it.
        near = math.exp(ORDER_STEP * round(math.log(specimen.modulus) / ORDER_STEP))
        guess = _near_path(reduced, specimen.unit, near) if near != specimen.modulus else None
    return LoadingPath(_problem(reduced, specimen), 0.0, guess)


@kept(64)
def _near_path(reduced: ReducedFinger, unit: Specimen, modulus: float) -> ContactPath | None:
    """The path without friction on a specimen of another modulus (MPa) than 1."""
    return _plain_path(reduced, replace(unit, modulus=modulus)).whole


@kept()
def _rubbing_path(reduced: ReducedFinger, specimen: Specimen, friction: float) -> "LoadingPath":
    return LoadingPath(_problem(reduced, specimen, tractions=True), friction, _plain_path(reduced, specimen).whole)


def _problem(reduced: ReducedFinger, specimen: Specimen, *, tractions: bool = False) -> ContactProblem:
    """The contact of a finger and a specimen, for pressure alone or with tangential `tractions`."""
    patch, unit = reduced.patch, specimen.unit
    return ContactProblem(
        reduced.traction_compliance if tractions else reduced.compliance,
        patch.mass,
        weak_gap(patch, unit),
        ((patch.xy == 0) & (patch.images < 0).any(axis=0)).T if tractions else None,
        reduced.specimen_compliance(unit, tractions=tractions),
        specimen.modulus if specimen.elastic else 1.0,
    )


class LoadingPath:
    """States of growing indentation with Coulomb's coefficient, 0 for none, infinite for stick; computed as far as
    needed, and kept.

    whole : the exact path of a contact that only grows; None with Coulomb's law.
    guess : the path of a similar problem on the same nodes, or of this one without friction, whose order is tried
    first.
    """

    def __init__(self, problem: ContactProblem, friction: float, guess: ContactPath | None = None):
        self.problem, self.friction = problem, min(friction, ROUGH_FRICTION)
        margin = {0.0: PLAIN_MARGIN, ROUGH_FRICTION: STUCK_MARGIN}.get(self.friction)
        self.whole = ContactPath(problem, guess, margin) if margin else None

    @cached_property
    def steps(self) -> SteppedPath:
        """The same path by steps, for Coulomb's law and for contacts that nodes leave again."""
        return SteppedPath(self.problem, self.friction)

    def at(self, *, force: float | None = None, indentation: float | None = None) -> ContactState | None:
        """The state at a force on the patch (N) or an indentation (mm); it does not depend on what was computed before.
        None before first touch. Raises `SolverError` if a step does not converge."""
        if self.whole is not None:
            with suppress(LeavingError):
                return self.whole.at(force=force, indentation=indentation)
        return self.steps.at(force=force, indentation=indentation)

    def words(self, contact: ContactState) -> str:
        """Words for the status of a press, which describe a state."""
        touching = int(contact.active.sum())
        if not self.friction:
            return f"{touching} nodes in contact"
        if self.whole is not None:
            return f"stuck from the moment of contact, the force grown from first touch in {touching} steps"
        assert isinstance(contact, StepState)
        steps = sum(knot.indentation < contact.indentation for knot in self.steps.knots)
        slips = f"{contact.slipping.sum()} of {touching} nodes slip"
        return f"friction {self.friction:g}: {slips}, the force grown from first touch in {steps} steps"


@dataclass(frozen=True)
class ContactShape:
    """Area (mm2) and peak pressure (MPa). `elliptic` is True if an ellipse has the moments of the pressure; else nodes
    were counted."""

    area: float
    peak_pressure: float
    elliptic: bool


def contact_press(reduced: ReducedFinger, specimen: Specimen, load: Load, friction: float = 0.0) -> Press:
    """The press of a `load`, as the nodes of the patch give it, with Coulomb's coefficient (infinite for stick).

    The finger moves along the contact normal and is held sideways. Raises `ContactRangeError` if the contact reaches
    the rim, goes too deep, or is smaller than the mesh can resolve, and what `loading_path` raises.
    """
    force, indentation = load
    refuse_detail(specimen, reduced.patch, reduced.mesh_size_mm)
    path = loading_path(reduced, specimen, friction)
    # The path is that of the patch alone, a quarter of the contact if mirrors are used: its force is a share of the
    # whole.
    share = None if force is None else force / reduced.multiplicity
    contact = path.at(force=share, indentation=indentation)
    if contact is None or not contact.active.any():
        raise NoContactError(f"an indentation of {indentation:g} mm makes no contact on this mesh: it is too coarse")
    pressure, shear = contact.traction[0], contact.traction[1:]
    total = float(reduced.multiplicity * reduced.patch.mass @ pressure)
    shape = None
    with suppress(ContactRangeError):
        scene = hertz_scene(reduced, specimen, (total, None))
        shape = contact_shape(reduced.patch, pressure, scene.layer_term)
        # Only if both fidelities give the same ellipse, the layer term of `hertz` is the better one.
        shape = shape if abs(scene.contact_area / shape.area - 1) < SAME_ELLIPSE else None
    shape = shape or contact_shape(reduced.patch, pressure)
    coarse = too_coarse(shape.area, reduced.patch.mean_edge(contact.active), reduced.mesh_size_mm)
    status = coarse or f"contact: {path.words(contact)}"
    if coarse is None and reduced.at != (0.0, 0.0):
        status += f"; off the apex the mesh is coarser, so readings are accurate to {PER_CENT * OFF_APEX:g} %"
    rows = reduced.traction_rows if friction else reduced.rows
    return linear_press(
        reduced,
        specimen,
        force=total if force is None else force,
        fidelity="contact",
        indentation=contact.indentation,
        contact_area=shape.area,
        peak_pressure=shape.peak_pressure,
        values=rows @ contact.traction.ravel(),
        force_balance=0.0 if force is None else abs(total - force) / force,
        status=status,
        resolved=coarse is None,
        pressure=pressure,
        active=contact.active,
        shear=shear if friction else None,
        friction=friction,
    )


def with_ellipse(reduced: ReducedFinger, specimen: Specimen, press: Press) -> Press:
    """A contact press, corrected by the ellipse if the contact is only a few elements wide; else the same press.

    The effect of friction keeps its nodal value, because the ellipse has no friction.
    """
    elements = float(np.sqrt(press.contact_area / np.pi)) / reduced.patch.mean_edge(press.active)
    weight = 1 / (1 + (elements / EQUAL_ELEMENTS) ** WEIGHT_STEEPNESS)
    if weight < NEGLIGIBLE_WEIGHT:
        return press
    try:
        scene = hertz_scene(reduced, specimen, (press.force, None))
    except ContactRangeError:
        return press
    # The ellipse knows no friction. So it is compared with the nodes without friction, and only the difference is
    # added.
    nodes = contact_press(reduced, specimen, (press.force, None)) if press.friction else press
    ratios = {name: getattr(scene, name) / getattr(nodes, name) for name in CONTACT_MEASURES}
    if any(abs(ratios[name] - 1) > limit for name, limit in SAME_CONTACT.items()):
        return press
    # A geometric mean with the weight w: a positive measure stays positive.
    measures = {name: getattr(press, name) * ratio**weight for name, ratio in ratios.items()}
    return replace(press, values=press.values + weight * (scene.values - nodes.values), **measures)


def contact_shape(patch: Patch, pressure: np.ndarray, expected_q: float | None = None) -> ContactShape:
    """Area and peak of a nodal pressure (n,) in MPa on a patch with all its images.

    `expected_q` is the profile's layer term of least energy, used if the contact is too small for its moments to
    determine q.
    """
    # Moments of the pressure, which average over the mesh, instead of counting nodes, which jump.
    points, weights, hats = quadrature(patch)
    load = weights * (hats @ pressure)
    total = float(load.sum())
    share = load / total
    mirrored = (patch.images < 0).any(axis=0)
    x, y = (points - np.where(mirrored, 0.0, share @ points)).T
    xx, yy = float(share @ x**2), float(share @ y**2)
    xy = 0.0 if mirrored.any() else float(share @ (x * y))
    determinant = xx * yy - xy**2
    counted = ContactShape(len(patch.images) * float(patch.mass[pressure > 0].sum()), float(pressure.max()), False)
    # A contact that the skin's own edge cuts off, as on a slab, is not an ellipse either
    cut_off = pressure[patch.outline].max() > CUT_OFF_PRESSURE_SHARE * pressure.max()
    if cut_off or determinant <= 0:
        return counted
    # Squared radius in the metric of the second moments, its mean under the pressure being 1: independent of size,
    # aspect and direction of the ellipse.
    square = (yy * x**2 - 2 * xy * x * y + xx * y**2) / (2 * determinant)
    (terms, shares), inner = _profiles(), float(share @ np.maximum(0.0, 1 - square / INNER_SQUARED_RADIUS) ** 2)
    if not shares[0] <= inner <= shares[-1]:
        return counted
    q = float(np.interp(inner, shares, terms))
    # Hertz's radius is accurate enough to count the elements across it
    edge = patch.mean_edge(pressure > 0)
    spread = float(np.sqrt(determinant))
    elements = float(np.sqrt(2 * spread / ellipses.SECOND_MOMENTS[0]) / edge)
    # The third moment of u must be that of the family, too: else the contact is no ellipse of this kind.
    sixth = ((1 - q) * ellipses.SIXTH_MOMENTS[0] + q * ellipses.SIXTH_MOMENTS[1]) / ellipses.mean_square(q) ** 3
    if abs(sixth / float(share @ square**3) - 1) > TRUSTED_MISMATCH + TRUSTED_COARSE_MISMATCH / elements**4:
        return counted
    # With few elements across the contact the moments do not determine q: blend from the expected to the measured one.
    prior_q, needed = (0.0, TELLING_ELEMENTS) if expected_q is None else (expected_q, RESOLVING_ELEMENTS)
    q = prior_q + (q - prior_q) / (1 + (needed / elements) ** 12)
    # For an ellipse the root of the determinant is a b <u> / 2, so pi a b follows from it.
    area = 2 * np.pi * spread / ellipses.mean_square(q)
    reached = len(patch.images) * float(weights[load > 0].sum())
    if abs(area - counted.area) > EDGE_BAND * (reached - counted.area):
        return counted
    mean = len(patch.images) * total / area
    return ContactShape(area, mean * ellipses.peak_over_mean(q), True)


@cache
def _profiles() -> tuple[np.ndarray, np.ndarray]:
    """Layer terms and the inner shares of their profiles, both (k,) and rising."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    t, terms = (1 + nodes) / 2, np.linspace(ellipses.FLATTEST_Q, ellipses.SHARPEST_Q, 501)[:, None]
    inner = np.maximum(0.0, 1 - (1 - t**2) / ellipses.mean_square(terms) / INNER_SQUARED_RADIUS) ** 2
    return terms[:, 0], inner * ellipses.layer_factor(t, terms) * t @ weights
