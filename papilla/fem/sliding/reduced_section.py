"""`ReducedSection`: a section condensed to the data that sliding needs; made once for a finger and kept in the
cache."""

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from papilla import cache, checks
from papilla.errors import InputError
from papilla.fem.reduction.gauges import gauge_weights
from papilla.fem.sliding.section_model import STRESS_STATES, Modes, SectionModel
from papilla.finger import Finger, Slab
from papilla.mesh.section import SIZE_MM, build_section, section_finger
from papilla.units import MICROSTRAIN_PER_STRAIN

MODES = 40
"""Number of modes that are kept; the last one of the default finger's section is at 540 Hz."""

DENSITY_G_CM3 = 1.07
"""Density of silicone, g/cm3."""


@dataclass(frozen=True, eq=False, repr=False)
class ReducedSection:
    """A section per mm along y; n nodes of the surface that may touch, g gauges, q quantities, k modes.

    x, z : (n,) the nodes, and z averaged over their hat functions, mm. hats : (n, 2) width of each node's hat function
    to the left and to the right, 0 at a ridge's edge. compliance : (2n, 2n) displacement along x, then inward, under
    forces in the same order, mm per N/mm. rows : (q, g, 2n) quantities of the gauges per N/mm. weights : (q, g) of the
    quantities in a reading.
    modes : of free vibration. ridge_pitch : mm, 0 for a smooth skin. half_width : largest distance of the contact from
    the apex. bone_top : z of the bone's top.
    """

    x: np.ndarray
    z: np.ndarray
    hats: np.ndarray
    compliance: np.ndarray
    rows: np.ndarray
    weights: np.ndarray
    modes: Modes
    ridge_pitch: float
    half_width: float
    bone_top: float

    def __repr__(self) -> str:
        return f"ReducedSection({len(self.x)} nodes, {self.rows.shape[1]} gauges, ridge pitch {self.ridge_pitch:g} mm)"

    @property
    def reading_rows(self) -> np.ndarray:
        """(g, 2n) readings in microstrain per N/mm."""
        return MICROSTRAIN_PER_STRAIN * np.einsum("qg,qgn->gn", self.weights, self.rows)

    @property
    def reading_modes(self) -> np.ndarray:
        """(g, k) readings in microstrain per unit of each mode."""
        return MICROSTRAIN_PER_STRAIN * np.einsum("qg,qgk->gk", self.weights, self.modes.gauges)


def prepare_section(
    finger: Finger,
    *,
    size_mm: float = SIZE_MM,
    ridges: bool = True,
    stress: str = STRESS_STATES[0],
    progress: Callable[[str], None] = lambda line: None,
) -> ReducedSection:
    """Mesh, factorise and condense a finger's section, or take it from the cache.

    ridges : whether the finger's ridges stand on its skin. stress : "plane strain", or "plane stress" for a thin slab.
    Raises `InputError` for a finger without an exact section and for bad options, and `SolverError`.
    """
    if stress not in STRESS_STATES:
        raise InputError(f"stress must be one of {', '.join(STRESS_STATES)}, got {stress!r}")
    checks.positive("size_mm", size_mm)
    own = section_finger(finger)

    def make() -> dict[str, np.ndarray]:
        progress("condensing the section, some seconds the first time")
        return _arrays(SectionModel(own, build_section(own, size_mm=size_mm, ridges=ridges), stress=stress))

    with_ridges = None if finger.ridges is None or not ridges else finger.ridges
    key = cache.key(__name__, own.sha256, float(size_mm), with_ridges, stress, MODES, DENSITY_G_CM3)
    found = cache.fetch("section", key, make)
    modes = Modes(*(found.pop(f"mode_{field.name}") for field in fields(Modes)))
    half_width, bone = float(found.pop("half_width")), own.shape
    assert isinstance(bone, Slab)
    return ReducedSection(
        **found,
        weights=gauge_weights(own),
        modes=modes,
        ridge_pitch=with_ridges.pitch if with_ridges else 0.0,
        half_width=half_width,
        bone_top=bone.bone[1],
    )


def _arrays(model: SectionModel) -> dict[str, np.ndarray]:
    """The arrays of a `ReducedSection`, as they are cached."""
    compliance, rows = model.condense()
    modes = model.modes(MODES)
    section, vertices = model.section, model.patch_vertices
    hats = np.zeros((len(vertices), 2))
    order = np.searchsorted(section.points[vertices, 0], section.points[section.spans, 0])
    width = np.diff(section.points[section.spans, 0], axis=1)[:, 0]
    hats[order[:, 0], 1] = hats[order[:, 1], 0] = width
    z = section.points[vertices, 1]
    neighbours = [np.roll(z, 1), np.roll(z, -1)]
    # The mean of a straight edge under a hat with its peak at one end lies a third of the way to the other end
    z_mean = z + sum(hats[:, c] * (other - z) / 3 for c, other in enumerate(neighbours)) / hats.sum(axis=1)
    return {
        "x": section.points[vertices, 0],
        "z": z_mean,
        "hats": hats,
        "compliance": compliance,
        "rows": rows,
        "half_width": np.array(section.half_width),
        **{f"mode_{field.name}": getattr(modes, field.name) for field in fields(Modes)},
    }
