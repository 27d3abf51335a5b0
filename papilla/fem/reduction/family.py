"""`FingerFamily`: all fingers of one geometry, with any moduli of their layers, from a few reductions.

At fixed geometry and Poisson's ratios the condensed finger depends on the moduli through their ratio r = outer / inner
alone: compliance and gauge rows are proportional to 1 / inner. They are smooth in ln r, so a polynomial through
Chebyshev nodes gives them at every other ratio (Trefethen, Approximation Theory and Approximation Practice, SIAM 2019,
theorem 8.2).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial

import numpy as np
from scipy.interpolate import BarycentricInterpolator

from papilla.core import cache, checks
from papilla.core.errors import InputError
from papilla.core.progress import Progress, silent
from papilla.fem.reduction.finger_model import FingerModel
from papilla.fem.reduction.reduced import ReducedFinger, fetch_tangential
from papilla.mesh import LayeredMesh, build
from papilla.model.finger import Finger, Layer

MODULUS_RATIO_ENDS = (1.0, 16.0)
"""Smallest and largest ratio of the skin's modulus to that of the layer below."""

CHEBYSHEV_NODES = 7
"""Number of Chebyshev nodes in ln r. Between them compliance and rows of the default finger differ by at most 4e-5 of
their largest entry from those of a finger that is reduced separately."""

OF_THE_RATIO = ("compliance", "rows")
"""Fields that depend on the ratio; all others depend on the geometry alone, or follow by arithmetic."""


@dataclass(frozen=True, eq=False)
class FingerFamily:
    """Reduced fingers at k ratios of the layers' moduli, and any ratio between them; n patch nodes, g gauges, q
    quantities.

    finger : the design; its moduli are ignored. reduced : one member, for the fields that all share.
    ratios : (k,) outer over inner modulus. compliance : (k, n, n) in mm3, and rows : (k, q, g, n), for an inner layer
    of 1 MPa.
    tangential_source : computes, when friction needs it, the effect of tangential tractions
    (`ReducedFinger.tangential`) at each ratio: (k, 3n, 2n) and (k, q, g, 2n), for an inner layer of 1 MPa.
    model : makes the finger model of a ratio on the mesh, with the inner modulus of the design.
    """

    finger: Finger
    reduced: ReducedFinger
    ratios: np.ndarray
    compliance: np.ndarray
    rows: np.ndarray
    tangential_source: Callable[[], tuple[np.ndarray, np.ndarray]]
    model: Callable[[float], FingerModel]

    def __repr__(self) -> str:
        low, high = self.ratios.min(), self.ratios.max()
        return f"FingerFamily({self.finger.name!r}, outer / inner {low:g} to {high:g})"

    def at(self, outer: float, inner: float) -> ReducedFinger:
        """The finger with these Young's moduli (MPa); raises `InputError` if their ratio is outside the family."""
        design = with_moduli(self.finger, outer, inner)
        ratio = checks.within("outer over inner modulus", outer / inner, self.ratios.min(), self.ratios.max())
        weights = self._basis(np.log(ratio)) / inner
        compliance, rows = (np.einsum("k,k...->...", weights, getattr(self, name)) for name in OF_THE_RATIO)
        thickness = self.reduced.layers[:, 0]
        moduli = [layer.modulus for layer in (design.outer, design.inner, design.bone) if layer][: len(thickness)]
        return replace(
            self.reduced,
            finger_sha256=design.sha256,
            strain_key=design.strain_sha256,
            outer_modulus=outer / (1 - design.outer.nu**2),
            compliance=compliance,
            rows=rows,
            layers=np.column_stack([thickness, moduli]),
            tangential_source=lambda: self._tangential(weights),
        )

    def _tangential(self, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        compliance, rows = self.tangential_source()
        return np.einsum("k,k...->...", weights, compliance), np.einsum("k,k...->...", weights, rows)

    @cached_property
    def _basis(self) -> BarycentricInterpolator:
        """Cardinal functions (k,) of the nodes, over ln r."""
        return BarycentricInterpolator(np.log(self.ratios), np.eye(len(self.ratios)))


def family(
    finger: Finger,
    *,
    size_mm: float | None = None,
    at: tuple[float, float] = (0.0, 0.0),
    variant: int = 0,
    mesh: LayeredMesh | None = None,
    progress: Progress = silent,
) -> FingerFamily:
    """The family of a finger's geometry and Poisson's ratios on mesh number `variant`, at touch-down point `at` (mm).

    mesh : another mesh of the same shape, for example of a finger with gauges at other places.

    Seven reductions, kept in the cache. Raises what `prepare` raises, and `InputError` for
    layers that are not neo-Hookean, because large strain then depends on more than the ratio.
    """
    if any(layer.material is not None for layer in (finger.outer, finger.inner)):
        raise InputError("a family needs layers with a modulus alone, without a material card")
    if finger.bone is not None:
        raise InputError("a family needs a rigid bone: an elastic one has a third modulus")
    inner = finger.inner.modulus
    unit = with_moduli(finger, inner, inner)
    if mesh is None:
        mesh = build(unit, size_mm=size_mm, variant=variant, progress=progress)
    # Chebyshev's points of the first kind in ln r, stretched to the ends of the range
    points = -np.cos(np.pi * (np.arange(CHEBYSHEV_NODES) + 0.5) / CHEBYSHEV_NODES) / np.cos(np.pi / 2 / CHEBYSHEV_NODES)
    low, high = np.log(MODULUS_RATIO_ENDS)
    nodes = np.exp((low + high) / 2 + (high - low) / 2 * points)

    # Made when the first model is asked for: a family from the cache needs none
    first = lru_cache(partial(FingerModel, unit, mesh))

    # Moduli enter as multiples of the inner one, so what is stored for an inner layer of 1 MPa serves all.
    def model(ratio: float) -> FingerModel:
        member = FingerModel(with_moduli(finger, ratio * inner, inner), mesh)
        member.space = first().space  # The assembled parts hold for all ratios
        return member

    def members(tangential: bool) -> Iterator:
        for number, ratio in enumerate(nodes, start=1):
            progress(f"family: modulus ratio {ratio:.3g} ({number} of {CHEBYSHEV_NODES})")
            member = model(ratio)
            yield member.reduce_tangential(at) if tangential else member.reduce(at)

    def make() -> dict[str, np.ndarray]:
        """Reduce the finger at all ratios."""
        reduced = list(members(False))
        arrays = {name: inner * np.stack([getattr(member, name) for member in reduced]) for name in OF_THE_RATIO}
        return arrays | {f"reduced_{name}": values for name, values in reduced[0].to_arrays().items()}

    def make_tangential() -> tuple[np.ndarray, np.ndarray]:
        compliance, rows = (inner * np.stack(matrices) for matrices in zip(*members(True), strict=True))
        return compliance, rows

    key = cache.key(__name__, unit.sha256, mesh.sha256, at, nodes)
    arrays = cache.fetch("family", key, make)
    shared = {name.removeprefix("reduced_"): value for name, value in arrays.items() if name.startswith("reduced_")}

    tangential = partial(fetch_tangential, "family_tangential", key, make_tangential)
    by_ratio = {name: arrays[name] for name in OF_THE_RATIO}
    member = ReducedFinger.from_arrays(shared)
    return FingerFamily(finger, member, nodes, **by_ratio, tangential_source=tangential, model=model)


def with_moduli(finger: Finger, outer: float, inner: float) -> Finger:
    """The finger with these Young's moduli (MPa) of its layers."""
    return replace(finger, outer=Layer(outer, finger.outer.nu), inner=Layer(inner, finger.inner.nu))
