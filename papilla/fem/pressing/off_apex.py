"""Presses off the apex, by moving the tractions of presses at the apex along the skin; and `OffApex`, a smooth function
of them.

Near the apex the skin has nearly the curvature and compliance of the apex; only the place of the contact relative to
the gauges changes. So the tractions keep their shape in the contact plane, the plane moves with the skin, and by
reciprocity

    value of a gauge = sum over nodes of (adjoint field of the gauge at the moved node) . (nodal force).

One factorisation per parity and one solve per gauge serve all presses at all places (`transported_readings`).

`OffApex` is the change of each gauge's strain and curvature where a contact lies off the apex, or where gauges were
moved, for all fingers of one geometry. The change over F / E_inner is fitted by

    sum over nodes of L_i(x) L_j(y) L_k(along) L_l(across) P_ijkl(ln F/E_inner, ln E/E_inner, ln E_outer/E_inner),

where L are Lagrange polynomials on Chebyshev points of the place and of the gauge's shift, and P is a `LogPolynomial`
as in `Response`. Cost: a few seconds of solves for each geometry, then microseconds per press, with exact derivatives.
The change is that of linear presses; only the `Response` at the apex contains large strain, and the sigma
`MOVED_CHANGE_ERROR` covers the difference."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
import scipy.sparse as sp
from scipy.interpolate import BarycentricInterpolator

from papilla.core import cache, checks
from papilla.core.errors import InputError
from papilla.core.progress import Progress, silent
from papilla.core.units import to_microstrain
from papilla.fem.discrete.elements import fold, interpolation, parity_signs
from papilla.fem.pressing.response import (
    RESPONSE_FORCES_MM2,
    RESPONSE_POLYNOMIAL,
    SPECIMEN_MODULUS_RATIOS,
    scaled_presses,
)
from papilla.fem.reduction.family import MODULUS_RATIO_ENDS, FingerFamily
from papilla.fem.reduction.finger_model import FingerModel
from papilla.fem.reduction.gauges import GAUGE_QUANTITIES, gauge_functionals
from papilla.fem.reduction.patch import Frame, Patch, gap_of, quadrature
from papilla.mesh.scale import FingerScale
from papilla.model.finger import Finger
from papilla.model.specimen import Friction, Specimen

REACH_MM = 5.0
"""Largest |x| and |y| of a contact on a finger of `WIDTH_MM`; they scale with the finger's width."""

SHIFT_MM = 3.0
"""Largest shift of a gauge along and across the interface; it scales in the same way."""

WIDTH_MM = 48.0

PLACE_NODES, SHIFT_NODES = (7, 5), (5, 3)
"""Number of Chebyshev points along x and y, and of shifts along and across; odd, so that 0 is one of them."""

OFF_APEX_POLYNOMIAL = replace(RESPONSE_POLYNOMIAL, degrees=(6, 5, 4))
MIDDLE_NODES = tuple(count // 2 for count in (*PLACE_NODES, *SHIFT_NODES))
_AT_APEX: tuple[slice | int, ...] = (slice(None), *MIDDLE_NODES)
MOVED_PRESS_GRID, RATIO_NODES = (12, 10), 5
"""Forces, moduli and ratios of the presses whose tractions are moved."""

STRAIGHT_TURN_RAD = 1e-3
"""Turn of the skin's normal (rad) up to the largest place, below which the skin counts as straight."""

MOVED_CHANGE_ERROR = 0.08
"""Error of a gauge's change (one sigma), relative to the root mean square over the gauges: presses that were solved
beside the apex differ by 2 to 10 % from moved ones, and presses at finite strain by 4 % from linear ones
(docs/adr/0009)."""


def transported_readings(
    model: FingerModel, patch: Patch, traction: np.ndarray, places_mm: Sequence[float]
) -> np.ndarray:
    """Readings (k, m, g) in microstrain of m contacts at k places x along the finger, y = 0.

    Parameters
    ----------
    patch : that of `model.reduce()`, at the apex. traction : (m, 3, n) pressure and tangential tractions in MPa at the
        nodes, of presses there, as in `Press.traction`.
    places_mm : x (mm) of the touch-down point, as in `at=(x, 0)` of `FingerModel.reduce`.

    Raises `InputError` for tractions of another patch, or if a contact would leave the skin.
    """
    traction = np.asarray(traction, float)
    if traction.ndim != 3 or traction.shape[1:] != (3, len(patch.xy)):
        raise InputError(f"tractions must be (m, 3, {len(patch.xy)}), one row per press, got shape {traction.shape}")
    places = [checks.finite("place x (mm)", place) for place in places_mm]
    adjoints = on_each_side(model.reading_adjoints())
    pressed = np.any(traction, axis=(0, 1))
    rows = [MovedContact.at(model, patch, (place, 0.0), pressed).rows(adjoints) for place in places]
    return to_microstrain(np.einsum("kgcn,mcn->kmg", np.array(rows), traction))


@dataclass(frozen=True, eq=False)
class MovedContact:
    """The contact of the apex moved to another place of the skin; n nodes of its patch.

    directions : (3, 3) directions of pressure and the tangential tractions. pieces : for each image of the patch, and
    each image of the cell on which it lies, the signs of both and (nodes of the cell, n) integrals of shape function
    times hat function.
    """

    directions: np.ndarray
    pieces: tuple[tuple[np.ndarray, tuple[int, int], sp.csr_matrix], ...]

    @classmethod
    def at(
        cls, model: FingerModel, patch: Patch, place_mm: tuple[float, float], pressed: np.ndarray | None = None
    ) -> "MovedContact":
        """The contact moved to (x, y) in mm on the skin of `model`; pressed : (n,) nodes that may press: only they must
        stay on the skin. Raises `InputError` if they would leave it."""
        skin = model.surfaces["skin"]
        frame = Frame.at(skin, *place_mm)
        points, weights, hats = quadrature(patch)
        pressing = np.ones(len(points), bool) if pressed is None else (hats @ pressed.astype(float)) > 0
        points, loads = points[pressing], sp.diags(weights[pressing]) @ hats[pressing]
        pieces = []
        for image in patch.images:
            on_skin = frame.origin + (points * image) @ frame.axes[:2]
            on_skin = on_skin - gap_of(skin, frame, on_skin)[:, None] * frame.axes[2]
            folded, sides = fold(on_skin, model.mesh.mirrors)
            values = interpolation(model.space, folded)
            for sx, sy in np.unique(sides, axis=0).tolist():
                on_side = (sides == (sx, sy)).all(axis=1)
                pieces.append((image, (sx, sy), (values[on_side].T @ loads[on_side]).tocsr()))
        return cls(np.vstack([-frame.axes[2], frame.axes[:2]]), tuple(pieces))

    def rows(self, fields: Mapping[tuple[int, int], np.ndarray]) -> np.ndarray:
        """Work (k, 3, n) of unit nodal pressures and tangential tractions on fields on each image of the cell (nodes of
        the cell, 3, k), such as gauges' adjoints `on_each_side`."""
        work = 0.0
        for image, side, coupling in self.pieces:
            field = fields[side]
            displacement = (coupling.T @ field.reshape(len(field), -1)).reshape(-1, *field.shape[1:])
            work = work + np.einsum("nik,ci->kcn", displacement, self.directions * np.array([1, *image])[:, None])
        return np.asarray(work)


def on_each_side(fields: Mapping[tuple[int, int], np.ndarray]) -> dict[tuple[int, int], np.ndarray]:
    """Fields by parity (nodes of the cell, 3, k) as displacements of the cell's images, by the signs of these."""
    sides = [(sx, sy) for sx in (1, -1) for sy in (1, -1)]
    return {
        side: np.sum([field * parity_signs(parity, side)[:, None] for parity, field in fields.items()], axis=0)
        for side in sides
    }


@dataclass(frozen=True, eq=False)
class Changed:
    """Changes (n, q, g) of the gauges' values in n presses, and their derivatives.

    slopes : (n, q, g) by ln "force", ln "modulus" of the specimen and ln "ratio" as of `Felt`, by the place "x" and "y"
    of the contact (1/mm), and by each gauge's shift "along" and "across".
    """

    values: np.ndarray
    slopes: dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class MoveLimits:
    """How far (mm) contacts and gauges of a finger may be moved.

    reach, shift : farthest |x| and |y| of a contact, and shift of a gauge. rolling : (2,) mm along x and y by which a
    flat specimen's contact moves for a radian of tilt: radii of the skin at the apex, infinite where it is straight.
    """

    reach: float
    shift: float
    rolling: np.ndarray

    @classmethod
    def of(cls, relatives: FingerFamily) -> "MoveLimits":
        """The limits for a family's geometry: larger on a wider finger."""
        model = relatives.model(float(relatives.ratios[0]))
        share = float(np.ptp(model.mesh.points[:, 0])) / WIDTH_MM
        return cls(REACH_MM * share, SHIFT_MM * share, _rolling(model, REACH_MM * share))


@dataclass(frozen=True, eq=False)
class OffApex:
    """Changes of gauges' values for all fingers of one geometry; q quantities, g gauges.

    coefficients : (terms, x, y, along, across, q, g) of the change over F / E_inner (mm2) at the nodes. scale : the
    finger's `FingerScale.area`.
    """

    coefficients: np.ndarray
    limits: MoveLimits
    scale: float = 1.0

    def __repr__(self) -> str:
        return f"OffApex(contacts within {self.limits.reach:g} mm, gauges within {self.limits.shift:g} mm)"

    def changed(
        self, force_N, modulus_MPa, outer: float, inner: float, place_mm: np.ndarray, shift_mm: np.ndarray
    ) -> Changed:
        """Changes in presses by forces (n,) on specimens of moduli (n,) at places (n, 2), of the finger with these
        Young's moduli (MPa) and gauges shifted by (2, g) along and across. Raises `InputError` beyond `limits`."""
        for what, offset, most in (("contacts", place_mm, self.limits.reach), ("shifts", shift_mm, self.limits.shift)):
            if np.abs(offset).max(initial=0.0) > most * (1 + checks.ROUNDING_SHARE):
                far = float(np.abs(offset).max())
                raise InputError(f"{what} must lie within {most:g} mm along x and y, got {far:.3g} mm")
        x = np.asarray(force_N, float) / inner
        ratios = np.asarray(modulus_MPa, float) / inner, np.full(len(x), outer / inner)
        terms = OFF_APEX_POLYNOMIAL.terms((x / self.scale, *ratios))
        # Many presses share a place: interpolate once for each.
        spots, which = np.unique(place_mm, axis=0, return_inverse=True)
        places = _products(PLACE_NODES, spots.T, self.limits.reach)
        shifts = _products(SHIFT_NODES, shift_mm, self.limits.shift)
        # (g, 3, x y t q) are the gauges' own shifts and their two slopes, then (3, x y, t q g)
        shifted = np.swapaxes(shifts, 0, 1) @ self._by_gauge
        shifted = np.moveaxis(shifted, 0, -1).reshape(len(shifts), len(places[0][0]), -1)

        def at(factors: np.ndarray, place: int, shift: int) -> np.ndarray:
            table = (places[place] @ shifted[shift]).reshape(len(spots), len(self.coefficients), -1)[which]
            change = np.matmul(np.moveaxis(factors, 0, 1), table) * x[:, None, None]
            return np.moveaxis(change, 1, 0).reshape(len(factors), len(x), *self.coefficients.shape[-2:])

        value, *by = at(terms, 0, 0)
        slopes = dict(zip(("force", "modulus", "ratio"), by, strict=True))
        slopes["force"] = slopes["force"] + value
        for name, which_slope in {"x": (1, 0), "y": (2, 0), "along": (0, 1), "across": (0, 2)}.items():
            slopes[name] = at(terms[:1], *which_slope)[0]
        return Changed(value, slopes)

    @cached_property
    def _by_gauge(self) -> np.ndarray:
        """(g, along across, x y t q) coefficients."""
        *_, a, c, q, g = self.coefficients.shape
        return np.ascontiguousarray(np.einsum("txyacqg->gacxytq", self.coefficients)).reshape(g, a * c, -1)


def off_apex_change(
    family: FingerFamily, specimen: Specimen, friction: Friction, *, progress: Progress = silent
) -> OffApex:
    """Change of the gauges' values by moved contacts and gauges, for the presses of a family on one shape of specimen;
    kept in the cache.

    Raises `InputError` if the farthest contact would leave the skin, or a gauge the interface.
    """
    parts = (family.compliance, family.rows, family.reduced.to_arrays(), family.finger.sha256)
    design = (PLACE_NODES, SHIFT_NODES, MOVED_PRESS_GRID, RATIO_NODES, REACH_MM, SHIFT_MM)
    key = cache.key(__name__, *parts, repr(replace(specimen, modulus=1.0)), str(friction), *design)
    arrays = cache.fetch("off_apex", key, lambda: {"coefficients": _made(family, specimen, friction, progress)})
    return OffApex(arrays["coefficients"], MoveLimits.of(family), FingerScale.of(family.finger).area)


def _made(family: FingerFamily, specimen: Specimen, friction: Friction, progress: Progress) -> np.ndarray:
    """Coefficients of an `OffApex`: solves the adjoint fields of the gauges, moves presses along the skin, and fits."""
    first = family.model(float(family.ratios[0]))
    limits = MoveLimits.of(family)
    places = limits.reach * np.array(_stencil(PLACE_NODES))

    progress("contacts off the apex")
    contacts = [MovedContact.at(first, family.reduced.patch, (x, y)) for x, y in places.tolist()]
    ratios = np.exp(_points(RATIO_NODES) * np.log(MODULUS_RATIO_ENDS[1]) / 2) * MODULUS_RATIO_ENDS[1] ** 0.5
    loads, values = [], []
    for number, ratio in enumerate(ratios.tolist(), start=1):
        progress(f"gauges and contacts moved: modulus ratio {ratio:.3g} ({number} of {RATIO_NODES})")
        pressed, traction = _presses(family, ratio, specimen, friction)
        loads.append(pressed)
        felt = _felt(family.model(ratio), limits.shift, contacts, traction)
        base = felt[_AT_APEX][:, None, None, None, None]
        # The change from the apex, over F / E_inner, which takes most of its dependence on the force away.
        values.append((felt - base) / pressed[:, 0].reshape(-1, *[1] * (felt.ndim - 1)))
    x, *others = np.concatenate(loads).T
    terms = OFF_APEX_POLYNOMIAL.terms((x / FingerScale.of(family.finger).area, *others))[0]
    flat = np.concatenate(values)
    return np.linalg.lstsq(terms, flat.reshape(len(flat), -1))[0].reshape(-1, *flat.shape[1:])


def _felt(model: FingerModel, shift: float, contacts: list[MovedContact], traction: np.ndarray) -> np.ndarray:
    """Gauge values (m, x, y, along, across, q, g) under tractions (m, 3, n) at each contact, for gauges moved by each
    fraction of `shift` (mm)."""
    designs = [_shifted(model.finger, shift * np.array(moved)) for moved in _stencil(SHIFT_NODES)]
    functionals = [
        functional for design in designs for functional in gauge_functionals(design, model.surfaces["interface"])
    ]
    fields = on_each_side(model.adjoints(functionals))
    felt = [np.einsum("kcn,mcn->mk", contact.rows(fields), traction, optimize=True) for contact in contacts]
    gauges = len(model.finger.gauges)
    return np.stack(felt, axis=1).reshape(len(traction), *PLACE_NODES, *SHIFT_NODES, len(GAUGE_QUANTITIES), gauges)


def _presses(
    family: FingerFamily, ratio: float, specimen: Specimen, friction: Friction
) -> tuple[np.ndarray, np.ndarray]:
    """Presses of a member at the apex: (m, 3) F / E_inner, E / E_inner and the ratio of moduli; and tractions (m, 3,
    n)."""
    inner = family.finger.inner.modulus
    member = family.at(ratio * inner, inner)
    forces = RESPONSE_FORCES_MM2 * FingerScale.of(family.finger).area
    ranges = zip((forces, SPECIMEN_MODULUS_RATIOS), MOVED_PRESS_GRID, strict=True)
    grid = (np.geomspace(values[0], values[-1], count) for values, count in ranges)
    presses = [*scaled_presses(member, inner, specimen, friction, *grid)]
    if len(presses) < MOVED_PRESS_GRID[0]:
        raise InputError(f"only {len(presses)} presses of the finger at a modulus ratio of {ratio:.3g} can be made")
    rows = [(force, modulus, ratio) for force, modulus, *_ in presses]
    return np.array(rows), np.array([press.traction for *_, press in presses])


def _rolling(model: FingerModel, reach: float) -> np.ndarray:
    """Radii (2,) of the skin at the apex along x and y, in mm."""
    skin, steps = model.surfaces["skin"], reach / 5 * np.array([1.0, -1.0])
    radii = []
    for axis in (0, 1):
        spots = steps[:, None] * np.eye(2)[axis]
        normals = skin.normal(np.column_stack([spots, skin.height(spots)]))
        # Turn of the normal per mm along the skin is the curvature; its inverse is the radius on which the contact
        # rolls.
        slope = float(np.diff(normals[:, axis] / normals[:, 2])[0] / np.diff(steps)[0])
        radii.append(1 / slope if slope * reach > STRAIGHT_TURN_RAD else np.inf)
    return np.array(radii)


def _shifted(finger: Finger, shift: np.ndarray) -> Finger:
    """The design with all gauges moved along and across by a shift (2,)."""
    gauges = (replace(g, moved_mm=(g.moved_mm[0] + shift[0], g.moved_mm[1] + shift[1])) for g in finger.gauges)
    return replace(finger, gauges=tuple(gauges))


def _points(count: int) -> np.ndarray:
    """Chebyshev's points of the second kind from -1 to 1, rising; the middle one is exactly 0."""
    points = -np.cos(np.pi * np.arange(count) / (count - 1))
    points[count // 2] = 0.0
    return points


def _stencil(counts: tuple[int, int]) -> list[tuple[float, float]]:
    """The nodes of a grid from -1 to 1 along two axes; the second coordinate changes first."""
    return [*product(*(_points(count).tolist() for count in counts))]


def _products(counts: tuple[int, int], at: np.ndarray, farthest: float) -> np.ndarray:
    """(3, n, nodes) weights of a grid's nodes at places (2, n) in mm, and their derivatives along either axis."""
    values, slopes = [], []
    for count, coordinate in zip(counts, at, strict=True):
        basis = BarycentricInterpolator(_points(count), np.eye(count))
        values.append(basis(coordinate / farthest))
        slopes.append(basis.derivative(coordinate / farthest) / farthest)
    pairs = (values[0], values[1]), (slopes[0], values[1]), (values[0], slopes[1])
    return np.array([np.einsum("na,nc->nac", *pair).reshape(len(pair[0]), -1) for pair in pairs])
