"""`GeometryMap`: the presses of one geometry, for all pairs of moduli and all places of gauges.

A geometry is a mapped mesh (`papilla.mesh`) and its reductions for several ratios of the moduli
(`papilla.fem.reduction.family`), with gauges at all `Places`. Presses on blocks depend only on F / E_inner, E / E_inner
and r = E_outer / E_inner; `papilla.fem.pressing.response` fits one polynomial to 2240 presses without friction, and one
to stuck presses. The change by large strain is measured once, on the study's own finger. Other geometries use it,
scaled to their size: at equal strains the force over E_inner is proportional to the square of the size.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from time import process_time
from typing import Any

import numpy as np

from papilla.calibration.fitting.sweep import NOT_INCLUDED
from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.progress import Progress, silent
from papilla.core.workers import workers
from papilla.design.places import FOIL_SIZES, Places
from papilla.fem.finite.strain_tables import RELATIVE_ELEMENT_SIZE, SPANNING_LAYER_RATIOS, begin_large_strain
from papilla.fem.pressing.large_strain import FIRST_GAUGE, LargeStrain, at_ratio, error_of_tables, keep, known
from papilla.fem.pressing.response import Response, response
from papilla.fem.reduction.family import MODULUS_RATIO_ENDS, family
from papilla.fem.reduction.gauges import GAUGE_QUANTITIES
from papilla.mesh import build
from papilla.mesh.body import narrowest_mm
from papilla.model.finger import Finger, Gauge, Layer
from papilla.model.specimen import STICK_WORD

CACHED_GEOMETRIES = 4
"""Number of geometries that a process keeps: 1 MB each for a row of places, 12 MB for all places."""
MESHED_DEG = (-40.0, -20.0, 0.0, 20.0, 40.0)
"""Places around which the mesh is fine: those of the default finger."""
STANDARD_MM = 20.0
"""Height or half breadth of the finger on which large strain is measured: that of the default finger."""
FRICTION_ENDS = (0.0, STICK_WORD)
"""Frictions of the two responses."""
STAGE_GEOMETRY, STAGE_RATIO, STAGE_GAUGES, STAGE_SCENES = "geometry", "ratio", "gauges", "scenes"
"""Stages of a worker: mesh and reductions; presses and the polynomial through them; sums over sites; surfaces and
touches."""
STAGE_SECONDS: defaultdict[str, float] = defaultdict(float)
"""Processor seconds of this process in each stage but the last, since a batch began; time that other programs use on a
busy machine does not count."""


@contextmanager
def spent_on(stage: str) -> Iterator[None]:
    """Add what is done inside to a stage; stages are not nested."""
    began = process_time()
    try:
        yield
    finally:
        STAGE_SECONDS[stage] += process_time() - began


@dataclass(frozen=True, eq=False)
class GeometryMap:
    """The responses without friction and stuck of one geometry, with gauges at all `places`."""

    finger: Finger
    places: Places
    ends: tuple[Response, Response]

    def of(self, finger: Finger) -> tuple[Response, Response]:
        """The responses for the gauges of a finger of this geometry; raises `InputError` for moduli outside the
        range."""
        ratio = finger.outer.modulus / finger.inner.modulus
        low, high = MODULUS_RATIO_ENDS
        if not low * (1 - checks.ROUNDING_SHARE) <= ratio <= high * (1 + checks.ROUNDING_SHARE):
            raise InputError(f"outer over inner modulus is {ratio:.3g}: a study covers {low:g} to {high:g}")
        weights = self.places.weights(finger.gauges, finger.shape)
        return _summed(self.ends[0], weights), _summed(self.ends[1], weights)

    def strain_error(self, finger: Finger, stuck: bool) -> float:
        """Relative error of S_d that a calibration of a finger of this geometry has by its tables of large strain."""
        if not self.ends[stuck].large_strain:
            return NOT_INCLUDED
        weights = self.places.weights(finger.gauges, finger.shape)
        tables = at_ratio(known(self.finger.strain_sha256), finger.outer.modulus / finger.inner.modulus, stuck)
        return error_of_tables([_table_of(table, weights) for table, _ in tables], gains_of(finger), stuck)


def gains_of(finger: Finger) -> np.ndarray:
    """(2, g) gains of membrane strain and curvature (mm) of a finger's gauges."""
    return np.array([[gauge.membrane_gain for gauge in finger.gauges], [gauge.lever_mm for gauge in finger.gauges]])


def _table_of(table: LargeStrain, weights: np.ndarray) -> LargeStrain:
    """A table whose sites (s) are combined to gauges (g) by weights (s, g)."""

    def gauges(site_values: np.ndarray) -> np.ndarray:
        felt = site_values[:, FIRST_GAUGE:].reshape(len(site_values), len(GAUGE_QUANTITIES), -1) @ weights
        return np.hstack([site_values[:, :FIRST_GAUGE], felt.reshape(len(site_values), -1)])

    return replace(table, linear=gauges(table.linear), finite=gauges(table.finite))


def _summed(by_site: Response, weights: np.ndarray) -> Response:
    """A response whose sites (s) are combined to gauges (g) by weights (s, g)."""
    first, sites = np.split(by_site.coefficients, [1], axis=1)
    sites = sites.reshape(-1, len(GAUGE_QUANTITIES), len(weights))
    felt = (sites @ weights).reshape(len(first), -1)
    error = np.sqrt((by_site.error[1:].reshape(len(GAUGE_QUANTITIES), -1) ** 2) @ weights**2).ravel()
    return replace(
        by_site,
        coefficients=np.hstack([first, felt]),
        gauge_count=weights.shape[1],
        error=np.append(by_site.error[0], error),
    )


def with_sites(finger: Finger, places: Places) -> Finger:
    """The geometry of a finger with a gauge at every place, without its moduli, gains and the friction of its bench."""
    return replace(
        finger,
        name="geometry",
        outer=Layer(1.0, finger.outer.nu),
        inner=Layer(1.0, finger.inner.nu),
        gauges=places.gauges(finger.shape),
        ridges=None,
        bench=replace(finger.bench, friction=None, touch_down=0.0),
        identified=None,
    )


MakesMap = Callable[[Finger, Places, Finger | None], GeometryMap]
"""From a geometry, its places and the finger whose large strain is known to its map."""


@lru_cache(maxsize=CACHED_GEOMETRIES)
def geometry_map(design: Finger, places: Places, base: Finger | None = None) -> GeometryMap:
    """The map of a design's geometry; from the cache the second time.

    design : from `with_sites`. base : the finger whose large strain is known, also from `with_sites`; None leaves large
    strain out. Raises what meshing, reducing and `response` raise.
    """
    with spent_on(STAGE_GEOMETRY):
        if base is not None:
            measure_base(base, 1, silent)  # Nothing to do if the client shares this cache
            borrow(design, base)
        size = RELATIVE_ELEMENT_SIZE * narrowest_mm(design)
        # The mesh is fine at the gauges of a real finger, not at all places
        few = tuple(Gauge(f"g{k}", angle_deg=angle) for k, angle in enumerate(MESHED_DEG))
        relatives = family(design, size_mm=size, mesh=build(replace(design, gauges=few), size_mm=size))
        relatives.tangential_source()  # Stuck presses need it, and find it in the cache
    with spent_on(STAGE_RATIO):
        block = design.bench.specimen(1.0)
        free, stuck = (response(relatives, block, friction=friction) for friction in FRICTION_ENDS)
    return GeometryMap(design, places, (free, stuck))


def measure_base(base: Finger, processes: int, progress: Progress) -> str:
    """Measure the large strain of a base, as `with_sites` makes it, where it is not known; what to note where it has to
    do without, else nothing.

    It is measured on a finger of the same shape and `STANDARD_MM`, because the forces of the tables are those of such a
    finger: on one a third as large, most contacts leave the patch.
    """
    if _covered(base):
        return ""
    like = _enlarged(base, STANDARD_MM / narrowest_mm(base))
    with workers(processes, progress) as start:
        note = begin_large_strain(like, (False, True), start, ratios=SPANNING_LAYER_RATIOS, progress=progress)()
    borrow(base, like)
    return note


def _covered(finger: Finger) -> bool:
    """Whether large strain of a geometry is known at all ratios of moduli, without friction and stuck."""
    tables = known(finger.strain_sha256)
    return all(at_ratio(tables, ratio, stuck) for ratio in SPANNING_LAYER_RATIOS for stuck in (False, True))


def _enlarged(finger: Finger, factor: float) -> Finger:
    """The finger and its gauges `factor` times as large, to 1e-9 mm: a third of the default becomes it again."""

    def times(of: Any, names: Iterable[str]) -> Any:
        """The object with these lengths, or tuples of lengths, enlarged."""
        lengths = {name: getattr(of, name) for name in names}
        sizes = {name: np.round(factor * np.array(value), 9).tolist() for name, value in lengths.items()}
        return replace(of, **{name: tuple(size) if isinstance(size, list) else size for name, size in sizes.items()})

    gauges = tuple(times(gauge, (*FOIL_SIZES, "y_mm")) for gauge in finger.gauges)
    stated = ["patch_radius"] if finger.patch_radius is not None else []
    return times(replace(finger, shape=times(finger.shape, vars(finger.shape)), gauges=gauges), stated)


def borrow(design: Finger, base: Finger) -> None:
    """Keep the base's tables of large strain, scaled in size, as those of a design with the same places."""
    tables = known(base.strain_sha256)
    if not tables or _covered(design):
        return
    size = narrowest_mm(design) / narrowest_mm(base)
    keep(design.strain_sha256, [_resized(table, size) for table in tables])


def _resized(table: LargeStrain, size: float) -> LargeStrain:
    """A table for a finger `size` times as large: lengths and curvatures change, strains and stresses do not."""
    sites = (table.linear.shape[1] - FIRST_GAUGE) // len(GAUGE_QUANTITIES)
    scale = np.concatenate([[size, size**2, 1.0], np.ones(sites), np.full(sites, 1 / size)])
    return replace(table, force=table.force * size**2, linear=table.linear * scale, finite=table.finite * scale)
