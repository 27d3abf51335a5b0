"""`press`: one press, with the requested fidelity or the cheapest one that is accurate enough.

The error of `hertz` is measured against `contact`, for this finger and specimen. Both have the errors of the mesh and
of small strain. The change by large strain is included if a table of it is known (`large_strain`). The status states
the remaining error and that of the mesh, if `papilla bench` has measured them (`prices`).
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter

import numpy as np

from papilla.core import checks
from papilla.core.errors import ContactRangeError, InputError, SolverError
from papilla.core.units import PER_CENT
from papilla.fem.pressing.contact import NoContactError, contact_press, with_ellipse
from papilla.fem.pressing.hertz import hertz_press, hertz_table
from papilla.fem.pressing.large_strain import between_ends, tables_of, with_large_strain
from papilla.fem.pressing.press import Load, Press, check_scene
from papilla.fem.pressing.prices import PRICED_QUANTITIES, Loss, Prices, known_prices
from papilla.fem.reduction.reduced import ReducedFinger, kept, needs_reduced
from papilla.model.specimen import Friction, Specimen, friction_coefficient

SETTLING_PRESSES = 4
"""Number of linear presses that find the indentation with large strain: the change is about 1 %, and each press leaves
a hundredth of the remaining error."""

LINEAR_FIDELITIES = ("hertz", "contact")
"""From cheap to expensive."""

QUANTITY_WORDS = dict(zip(PRICED_QUANTITIES, ("S_d", "indentation", "contact area"), strict=True))
"""The quantities that `auto` holds to its tolerance, in words."""

NEARLY_HERTZIAN = 0.1
"""Largest measured error of `hertz` at the lightest resolved press for which `auto` also uses it for lighter
presses."""

RELATIVE_PROBE_FORCES = np.geomspace(0.02, 1.0, 6) / (0.034 * 14.0**2)
"""Forces at which hertz is measured against contact, over E_inner times the square of the depth of the soft layers; for
the default finger, 0.034 MPa and 14 mm: 0.02 to 1 N."""

SOFT_LAYERS = 2
"""Layers below the touch-down point without the bone."""

NOT_STUCK = "; without friction, which is included with large strain alone: no table of that has such a press"
"""Appended to the status of a press that sticks by default but has no table of large strain."""


def press(
    reduced: ReducedFinger,
    specimen: Specimen,
    *,
    force: float | None = None,
    indentation: float | None = None,
    fidelity: str | None = None,
    tolerance: float = 0.02,
    friction: Friction | None = None,
) -> Press:
    """Press a specimen on the finger by a force (N) or an indentation (mm).

    Parameters
    ----------
    force, indentation : exactly one.
    fidelity : "hertz" and "contact" are linear. "auto" takes hertz if its error in S_d, indentation and contact area is
        within `tolerance` (measured against contact for this finger, specimen and force, plus the known error of the
        mesh), else contact with the change by large strain, if that is known (`large_strain` of the result). The status
        says which quantity decided and what is known of the errors of mesh and strain. None takes contact with large
        strain if that is known, else "auto". "finite" needs the mesh: use `press_finite`.
    friction : Coulomb's coefficient between finger and specimen, 0 for none, or "stick"; hertz has no friction. The
        force grows from first touch along the contact normal, because the effect of friction depends on the path. None
        takes the friction of the finger's bench; if the bench states none, presses with large strain stick, as silicone
        does on silicone, and linear presses have no friction (docs/adr/0013).

    Raises `InputError` for unusable values, `ContactRangeError` if the press is outside the range of the model.
    """
    began = perf_counter()
    needs_reduced(reduced)
    load = check_scene(specimen, reduced.outer_modulus, reduced.patch.finest_edge, force, indentation)
    checks.positive("tolerance", tolerance)
    if fidelity == "finite":
        raise InputError("fidelity finite needs the mesh, not the reduced finger: call papilla.fem.press_finite")
    if fidelity not in (*LINEAR_FIDELITIES, "auto", None):
        raise InputError(f"fidelity must be one of {', '.join(LINEAR_FIDELITIES)} or auto, got {fidelity!r}")
    friction = reduced.bench.friction if friction is None and fidelity != "hertz" else friction
    if friction_coefficient(friction or 0.0) and fidelity == "hertz":
        raise InputError("fidelity hertz has no friction: use fidelity auto or contact")
    if fidelity == "hertz":
        result = hertz_press(reduced, specimen, load, "hertz: as asked")
    else:
        result = _by_contact(reduced, specimen, load, fidelity, friction, tolerance)
    return replace(result, seconds=perf_counter() - began)


def _by_contact(
    reduced: ReducedFinger,
    specimen: Specimen,
    load: Load,
    fidelity: str | None,
    friction: Friction | None,
    tolerance: float,
) -> Press:
    """The press of a load by every fidelity but "hertz", with the parameters of `press`."""
    rubbing = friction_coefficient(friction or 0.0)
    contact, stuck = (partial(_contact, reduced, specimen, coefficient) for coefficient in (rubbing, math.inf))
    strained = partial(including_large_strain, reduced, specimen)
    alone = "; large strain, which raises S_d about as much as stick lowers it, is not included" if rubbing else ""
    if fidelity == "contact":
        result = _settled(load, contact)
        return replace(result, status=result.status + alone)
    doubt = ""
    if friction is None and tables_of(reduced, stuck=True):
        try:
            if stuck_press := _settled(load, stuck, strained):
                return stuck_press
            doubt = NOT_STUCK if specimen.curvature == (0.0, 0.0) else ""
        except InputError as error:
            doubt = f"; without friction: {error}"
    if rubbing or (fidelity is None and tables_of(reduced)):
        with suppress(*([] if rubbing else [NoContactError])):
            if large := _settled(load, contact, strained):
                return replace(large, status=large.status + doubt)
    linear = contact if rubbing else partial(_cheapest, reduced, specimen, tolerance)
    result = (None if rubbing else _settled(load, linear, strained)) or _settled(load, linear)
    losses = shared_losses(reduced, result.force, tolerance, result.large_strain)
    return replace(result, status=result.status + alone + doubt + losses)


def press_grid(
    reduced: ReducedFinger,
    specimens: Iterable[Specimen],
    forces: Sequence[float] | np.ndarray,
    friction: Friction | None,
) -> Iterator[tuple[Specimen, Press | ContactRangeError | SolverError]]:
    """Linear presses on specimens by rising forces (N). Yields the specimen and its press, or the error that refused
    it: all forces of a specimen, then the next specimen.

    Presses on one specimen share one contact path. The hardest press is made first, so the path is long enough for all
    others; in rising order it would have to be extended again and again.
    """
    for touched in specimens:
        outcomes: list[Press | ContactRangeError | SolverError] = []
        for force in map(float, reversed(forces)):
            try:
                # Of specimens that are far softer or harder than the finger
                with np.errstate(over="ignore"):
                    outcomes.append(press(reduced, touched, force=force, fidelity="contact", friction=friction))
            except (ContactRangeError, SolverError) as error:
                outcomes.append(error)
        yield from ((touched, outcome) for outcome in reversed(outcomes))


def including_large_strain(
    reduced: ReducedFinger, specimen: Specimen, small_strain: Press, *, beyond: bool = False
) -> Press | None:
    """A linear press with the change by large strain; None if that change is not known.

    Tables exist without friction and with full stick; for a coefficient between, both are used (`between_ends`). They
    hold for flat specimens only. beyond : see `with_large_strain`.
    """
    if specimen.curvature != (0.0, 0.0):
        return None
    if small_strain.friction in (0, math.inf):
        return with_large_strain(reduced, small_strain, beyond=beyond)

    def linear(friction: float) -> Press:
        """The same press with another friction."""
        return _contact(reduced, specimen, friction, (small_strain.force, None))

    ends = linear(0.0), linear(math.inf)
    free, stuck = (with_large_strain(reduced, end, beyond=beyond) for end in ends)
    return None if free is None or stuck is None else between_ends(reduced, small_strain, ends, (free, stuck), linear)


def _contact(reduced: ReducedFinger, specimen: Specimen, friction: float, load: Load) -> Press:
    """The linear contact press, corrected by the ellipse if the contact is small, which changes an indentation."""
    return with_ellipse(reduced, specimen, contact_press(reduced, specimen, load, friction))


def _settled(load: Load, make_press: Callable[[Load], Press], corrected=None):
    """The press at a load, which `made` makes and `corrected`, if given, corrects. A given indentation is that after
    all corrections. None if a press on the way cannot be corrected."""
    indentation, aim, result = load[1], load[1], None
    for _ in range(1 + SETTLING_PRESSES):
        result = make_press(load)
        result = corrected(result) if corrected else result
        if result is None or indentation is None or aim is None or result.indentation == indentation:
            break
        aim *= indentation / result.indentation
        load = None, aim
    return result


def _cheapest(reduced: ReducedFinger, specimen: Specimen, tolerance: float, load: Load) -> Press:
    """The press of the cheapest linear fidelity within the tolerance; its status says why this one was chosen."""
    error = hertz_error(reduced, specimen, load)
    if error is not None and error.error <= tolerance:
        return hertz_press(reduced, specimen, load, f"hertz: {error}, within {PER_CENT * tolerance:g} %")
    contact: Press | ContactRangeError
    try:
        contact = _contact(reduced, specimen, 0.0, load)
    except NoContactError as missed:
        contact = missed
    if isinstance(contact, NoContactError) or not contact.resolved:
        light = lightest_error(reduced, specimen)
        if light is not None and light.error <= NEARLY_HERTZIAN:
            reason = (
                "hertz: the contact is smaller than this mesh resolves, "
                f"and {light} from Hertzian at the lightest force that it does"
            )
            with suppress(ContactRangeError):
                return hertz_press(reduced, specimen, load, reason)
        if isinstance(contact, NoContactError):
            raise contact
        return contact
    if error is None:
        return replace(contact, status=f"{contact.status}; hertz is not measured at this force")
    return replace(contact, status=f"{contact.status}; hertz is off by {error}, over {PER_CENT * tolerance:g} %")


@dataclass(frozen=True)
class Worst:
    """The largest of the relative errors of several quantities, and the quantity that has it."""

    error: float
    quantity: str

    @classmethod
    def of(cls, errors: dict[str, float]) -> "Worst":
        """The largest of these errors."""
        quantity = max(errors, key=lambda name: errors[name])
        return cls(float(errors[quantity]), quantity)

    def __str__(self) -> str:
        return f"{PER_CENT * self.error:.1f} % in {QUANTITY_WORDS[self.quantity]}"


def hertz_error(reduced: ReducedFinger, specimen: Specimen, load: Load) -> Worst | None:
    """Measured error of hertz around a load; None if contact has no answer there.

    It is the difference of hertz from contact plus the known error of contact by the mesh: if the mesh uses a part of
    the tolerance, hertz may only use the rest.
    """
    force, indentation = load
    if indentation is not None:
        try:
            table = hertz_table(reduced, specimen)
        except ContactRangeError:
            return None
        force = float(np.interp(indentation, table.indentation, table.force))
    assert force is not None
    forces = _probe_forces(reduced)
    if not forces[0] <= force <= forces[-1]:
        return None
    right = int(np.clip(np.searchsorted(forces, force), 1, len(forces) - 1))
    around = probe_hertz(reduced, specimen)[right - 1 : right + 1].max(axis=0)
    if not np.isfinite(around).all():
        return None
    prices = _prices(reduced)
    mesh = [0.0 if prices is None else prices.mesh.at(force, name) or 0.0 for name in PRICED_QUANTITIES]
    return Worst.of(dict(zip(PRICED_QUANTITIES, around + mesh, strict=True)))


def lightest_error(reduced: ReducedFinger, specimen: Specimen) -> Worst | None:
    """Measured error of hertz at the lightest probe force whose contact the mesh resolves; None if there is none."""
    errors = probe_hertz(reduced, specimen)
    resolved = errors[np.isfinite(errors).all(axis=1)]
    return Worst.of(dict(zip(PRICED_QUANTITIES, resolved[0], strict=True))) if len(resolved) else None


def _probe_forces(reduced: ReducedFinger) -> np.ndarray:
    """`RELATIVE_PROBE_FORCES` of a finger in N."""
    thickness, modulus = reduced.layers[:SOFT_LAYERS].T
    return RELATIVE_PROBE_FORCES * modulus[-1] * thickness.sum() ** 2


@kept(256)
def probe_hertz(reduced: ReducedFinger, specimen: Specimen) -> np.ndarray:
    """Relative errors (probes, quantities) of hertz against contact at the probe forces; infinite if contact does not
    resolve the press."""
    errors = np.full((len(RELATIVE_PROBE_FORCES), len(PRICED_QUANTITIES)), np.inf)
    for k, force in enumerate(_probe_forces(reduced)):
        try:
            truth = contact_press(reduced, specimen, (float(force), None))
            scene = hertz_press(reduced, specimen, (float(force), None), "")
        except ContactRangeError:
            break
        if truth.resolved:
            errors[k] = relative_errors(scene, truth)
    return errors


def relative_errors(scene: Press, truth: Press) -> list[float]:
    """Errors of a press against a better one in each of `QUANTITIES`. If S_d says nothing, the readings are
    compared."""
    errors = [abs(getattr(scene, name) / getattr(truth, name) - 1) for name in PRICED_QUANTITIES if name != "sd"]
    if not truth.silent:
        return [abs(scene.sd / truth.sd - 1), *errors]
    largest = float(np.abs(truth.reading).max())
    return [float(np.abs(scene.reading - truth.reading).max()) / largest if largest else 0.0, *errors]


def shared_losses(reduced: ReducedFinger, force: float, tolerance: float, large_strain: bool) -> str:
    """Known errors of both linear fidelities at a force (N), in words that continue a sentence.

    large_strain : whether it is included, so that only the error of the mesh remains.
    """
    prices = _prices(reduced)
    if prices is None:
        where = "off the apex" if reduced.at != (0.0, 0.0) else "of this finger and mesh (papilla bench measures it)"
        cost = "the mesh costs" if large_strain else "mesh and small strain cost"
        return f"; what {cost} is not known {where}"
    names = ("mesh",) if large_strain else ("mesh", "small_strain")
    parts = {name: _worst(getattr(prices, name), force) for name in names}
    losses = [f"{name.replace('_', ' ')} {worst}" for name, worst in parts.items() if worst is not None]
    if not losses:
        return f"; what mesh and small strain cost is not known at {force:.3g} N"
    loss = f"; known to be off by ({prices.specimen}): {', '.join(losses)}"
    strain = parts.get("small_strain")
    if strain is not None and strain.error > tolerance:
        loss += (
            f"; small strain alone is over {PER_CENT * tolerance:g} %: --fidelity finite (press_finite) has none of it"
        )
    return loss


def _prices(reduced: ReducedFinger) -> Prices | None:
    """What is known of the errors of the fidelities, for a finger on its mesh; only at the apex."""
    return known_prices(reduced.finger_sha256, reduced.mesh_sha256) if reduced.at == (0.0, 0.0) else None


def _worst(loss: Loss, force: float) -> Worst | None:
    errors = {name: loss.at(force, name) for name in PRICED_QUANTITIES}
    measured = {name: error for name, error in errors.items() if error is not None}
    return Worst.of(measured) if measured else None
