"""Common to presses of every fidelity: the check of the input, the limits of the model, the causes of doubt, and the
result."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from papilla.core import checks
from papilla.core.errors import ContactRangeError, InputError
from papilla.core.units import PER_CENT, STRAIN_PER_MICROSTRAIN
from papilla.fem.reduction.gauges import GAUGE_QUANTITIES
from papilla.fem.reduction.patch import Patch
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.model.specimen import LARGEST_BLOCK_SHARE, Specimen

RESOLVED_RADIUS = 2.5
"""Smallest contact radius, in patch edge lengths, for which S_d of the contact fidelity is within 3 %
(docs/adr/0005)."""

SMALL_STRAIN_LIMIT = 0.1
"""Mean strain of a layer below the contact above which linear elasticity is doubtful: at 0.12 to 0.14 the indentation
differs by up to 7 % from finite strain, and single gauges of the default finger by 7 to 30 %."""

FACET_DISTANCE_SHARE = 0.02
"""Distance of the facets of a skin from the smooth surface, as a share of the indentation, above which the status
mentions it."""

THIN_SKIN, SKIN_MODULUS_RATIO = 3.0, 1.5
"""Contact radius in thicknesses of the skin, and ratio of its modulus to that below it, above which the skin bends like
a plate on a soft base, so that the pressure is not an ellipse: area and peak pressure were up to 7 % off at 0.5 and 1
mm, S_d 1 %."""

SKIN_ELEMENTS = 3.0
"""Thickness of the skin, in patch edge lengths, below which the status states what the mesh costs: 2.4 edges were 1.0
to 2.4 % off in S_d, 3.2 at most 0.7 % and 7 at most 0.3 % (a dome 7 mm high with 1 mm of skin)."""

ADVISED_SHARE = 0.7
"""Size that is advised, over the one that would do if elements were as large as asked and the contact as wide as on the
coarse mesh: those of a mapped mesh have up to 1.2 times that size, and a contact of few elements is up to a tenth too
wide."""

SILENT_SD_SHARE = 1e-9
"""S_d relative to the largest reading, below which S_d says nothing (one gauge, or mirror images): then readings are
compared."""

LIGHTEST_LOAD = 1e-18
"""Smallest force (relative to modulus times the square of an element) and indentation (in elements): smaller ones are
near the limit of floating-point numbers."""


CONTACT_MEASURES = ("indentation", "contact_area", "peak_pressure")
"""Measures of a contact, besides the gauges, that a light press and large strain correct by a factor."""

Load = tuple[float | None, float | None]
"""Force (N) and indentation (mm), one of them None."""


@dataclass(frozen=True, eq=False, repr=False)
class Press:
    """Result of one scene; n patch nodes, g gauges, q quantities of a gauge.

    force : N. modulus : of the specimen, MPa. fidelity : "hertz", "contact" or "finite".
    indentation : approach of specimen and finger, mm. contact_area : mm2. peak_pressure : MPa.
    values : (q, g) strain and curvature change at the gauges, in the order of
    `papilla.fem.reduction.gauges.QUANTITIES`.
    weights : (q, g) of these values in the readings.
    force_balance : relative difference of the pressure's integral from the force.
    large_strain : whether the change by large strain is included. friction : Coulomb's coefficient, infinite for stick.
    finger_share : share of the indentation by which the finger deforms; the specimen takes the rest. NaN if not known.
    status : what happened, in a sentence. resolved : whether the mesh is fine enough for this contact.
    pressure : (n,) in MPa at the patch nodes. active : (n,) nodes in contact.
    specimen_error : one sigma of ln S_d by the specimen's own large strain (`specimen_strain`).
    shear : (2, n) tangential tractions on the finger along the contact plane's axes, MPa; None without friction.
    seconds : that the whole press took; 0 for a part of one.
    """

    force: float
    modulus: float
    fidelity: str
    indentation: float
    contact_area: float
    peak_pressure: float
    values: np.ndarray
    weights: np.ndarray
    force_balance: float
    status: str
    resolved: bool
    pressure: np.ndarray
    active: np.ndarray
    shear: np.ndarray | None = None
    large_strain: bool = False
    friction: float = 0.0
    finger_share: float = np.nan
    specimen_error: float = 0.0
    seconds: float = 0.0

    def __repr__(self) -> str:
        readings = ", ".join(f"{value:.5g}" for value in self.reading)
        return (
            f"Press({self.fidelity}, {self.force:.4g} N, {self.indentation:.4g} mm, {self.contact_area:.4g} mm2, "
            f"S_d {self.sd:.5g} microstrain\n"
            f"  readings {readings} microstrain\n  {self.status})"
        )

    @cached_property
    def reading(self) -> np.ndarray:
        """Readings (g,) in microstrain."""
        return (self.weights * self.values).sum(axis=0) / STRAIN_PER_MICROSTRAIN

    @cached_property
    def sd(self) -> float:
        """S_d: population standard deviation (ddof 0) of the readings, in microstrain."""
        return float(self.reading.std())

    @property
    def silent(self) -> bool:
        """Whether S_d says nothing: one gauge, or gauges that all read the same."""
        return self.sd <= SILENT_SD_SHARE * float(np.abs(self.reading).max())

    @property
    def finger_indentation(self) -> float:
        """Indentation of the finger (mm): w_f of the 2006 paper, equation (7)."""
        return self.finger_share * self.indentation

    @property
    def specimen_indentation(self) -> float:
        """Indentation of the specimen (mm): w_o of the 2006 paper, equation (7)."""
        return self.indentation - self.finger_indentation

    @property
    def traction(self) -> np.ndarray:
        """Pressure and tangential tractions (3, n) at the patch nodes, MPa."""
        shear = np.zeros((2, len(self.pressure))) if self.shear is None else self.shear
        return np.vstack([self.pressure, shear])

    @property
    def strain(self) -> np.ndarray:
        """Strain (g,) at the gauges."""
        return self.values[list(GAUGE_QUANTITIES).index("strain")]

    @property
    def curvature(self) -> np.ndarray:
        """Curvature change (g,) at the gauges, 1/mm."""
        return self.values[list(GAUGE_QUANTITIES).index("curvature")]

    def to_json(self) -> dict:
        """The documented keys of a press, as plain values."""
        return {
            "force_N": self.force,
            "modulus_MPa": self.modulus,
            "fidelity": self.fidelity,
            "large_strain": self.large_strain,
            "indentation_mm": self.indentation,
            "contact_area_mm2": self.contact_area,
            "peak_pressure_MPa": self.peak_pressure,
            "gauge_strain": self.strain.tolist(),
            "reading_microstrain": self.reading.tolist(),
            "sd_microstrain": self.sd,
            "force_balance": self.force_balance,
            "status": self.status,
            "seconds": self.seconds,
        }


def check_scene(
    specimen: Specimen, stiffness: float, size: float, force: float | None, indentation: float | None
) -> Load:
    """The load of a press, after a check of specimen and load.

    force (N), indentation (mm) : exactly one. `stiffness` (MPa) and `size` (mm) are those of the finger and its
    elements. Raises `InputError`.
    """
    if not isinstance(specimen, Specimen):
        raise InputError(f"a press takes a HalfSpace, Block, Sphere or another Specimen, got {type(specimen).__name__}")
    loads: list[float | None] = []
    quantities = ("force (N)", force, stiffness * size**2), ("indentation (mm)", indentation, size)
    for name, value, scale in quantities:
        if value is not None:
            checks.positive(name, value)
            value = checks.within(name, value, LIGHTEST_LOAD * scale, scale / LIGHTEST_LOAD)
        loads.append(value)
    if (loads[0] is None) == (loads[1] is None):
        raise InputError("give exactly one of force and indentation")
    return loads[0], loads[1]


def refuse_detail(specimen: Specimen, patch: Patch, size: float) -> None:
    """Raise `ContactRangeError` if the patch, on a mesh with elements of `size` mm, is too coarse for a specimen."""
    edge = patch.finest_edge
    if specimen.detail < edge:
        raise ContactRangeError(
            f"the mesh is too coarse for a {specimen.words}: {edge:.2g} mm elements where it touches; "
            f"{_finer(size * specimen.detail / edge)}"
        )


def refuse_rim(patch: Patch, active: np.ndarray) -> None:
    """Raise `ContactRangeError` if a contact, given by its active nodes (n,), reaches the rim of its patch."""
    if (active & patch.rim).any():
        radius = float(np.hypot(*patch.xy[patch.rim].T).min())
        raise ContactRangeError(f"the contact reaches the rim of its patch, {radius:.3g} mm from the touch-down point")


def too_coarse(area: float, edge: float, size: float) -> str | None:
    """The note for a contact area (mm2) that is too small for elements of `edge` mm, on a mesh of nominal size `size`
    mm."""
    radius = float(np.sqrt(area / np.pi))
    if radius >= RESOLVED_RADIUS * edge:
        return None
    return (
        f"mesh too coarse for this light press: a contact radius of {radius:.2g} mm on {edge:.2g} mm elements, "
        f"S_d may be off by more than 3 %; {_finer(size * radius / (RESOLVED_RADIUS * edge))}"
    )


def _finer(size: float) -> str:
    """The advice to mesh so that elements are as small as a size (mm) would make them; rounded down to two digits."""
    step = 10.0 ** (math.floor(math.log10(ADVISED_SHARE * size)) - 1)
    below = step * math.floor(ADVISED_SHARE * size / step)
    return f"mesh with size_mm <= {below:.2g} ({checks.SIZE_OPTION})"


def linear_press(reduced: ReducedFinger, specimen: Specimen, *, status: str, **values) -> Press:
    """A `Press` of small-strain elasticity. Raises `ContactRangeError` beyond the range of the model; the status states
    what is doubtful.

    `values` are the other fields of a `Press`.
    """
    pressure, patch = values["pressure"], reduced.patch
    moved = reduced.compliance @ pressure / patch.mass
    finger_depth = float(moved.max())
    if finger_depth > LARGEST_BLOCK_SHARE * reduced.depth:
        raise ContactRangeError(
            f"the press reaches {finger_depth:.3g} mm into a finger with {reduced.depth:.3g} mm of soft tissue: "
            f"more than {PER_CENT * LARGEST_BLOCK_SHARE:g} % is beyond the model"
        )
    refuse_rim(patch, values["active"])
    theirs = reduced.specimen_displacement(specimen, pressure) / patch.mass
    taken = float(theirs.max())
    deepest = int(np.argmax(moved + theirs))
    values["finger_share"] = float(moved[deepest] / (moved[deepest] + theirs[deepest]))
    radius = float(np.sqrt(values["contact_area"] / np.pi))
    specimen.refuse(taken, radius)
    doubts, strain = [status], finger_depth / reduced.strained_depth
    if strain > SMALL_STRAIN_LIMIT:
        doubts.append(
            f"a layer is strained by {PER_CENT * strain:.0f} %, too much for linear elasticity: see press_finite"
        )
    if reduced.facets > FACET_DISTANCE_SHARE * values["indentation"]:
        share = PER_CENT * reduced.facets / values["indentation"]
        doubts.append(f"the facets of the skin stand {reduced.facets:.2g} mm off it, {share:.0f} % of the indentation")
    below = reduced.layers[1:, 1] / reduced.layers[0, 1]
    skin = reduced.skin_thickness
    if radius > THIN_SKIN * skin and below.size and not 1 / SKIN_MODULUS_RATIO <= below[0] <= SKIN_MODULUS_RATIO:
        thin = f"{radius:.2g} mm of contact on {skin:.2g} mm of skin"
        doubts.append(f"area and peak pressure within 8 %: {thin}")
    if skin < patch.finest_edge:
        coarse = f"{patch.finest_edge:.2g} mm elements are too coarse for a skin of {skin:.2g} mm"
        doubts.append(f"not to be trusted: {coarse}")
        values["resolved"] = False
    elif values["resolved"] and skin < SKIN_ELEMENTS * patch.finest_edge:
        doubts.append(
            f"a skin of {skin:.2g} mm on {patch.finest_edge:.2g} mm elements: S_d may be off by 2 %; "
            + _finer(reduced.mesh_size_mm * skin / (SKIN_ELEMENTS * patch.finest_edge))
        )
    return Press(modulus=specimen.modulus, weights=reduced.weights, status="; ".join(doubts), **values)
