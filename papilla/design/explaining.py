"""Estimates the cost of a study before it runs, by measurements on its own geometry."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

from papilla.design import sampling
from papilla.design.batch import judged
from papilla.design.geometry import geometry_map, measure_base, with_sites
from papilla.design.in_scene import DesignInScene
from papilla.design.study import Study, probes

TRIED = 5
"""Number of designs whose cost is measured."""


@dataclass(frozen=True)
class Price:
    """Designs and geometries of a study; seconds of a design and of a geometry, measured here; None if a geometry came
    from the cache, so that nothing was measured."""

    designs: int
    geometries: int
    sites: int
    per_design: float
    per_geometry: float
    cached: bool

    def seconds(self, workers: int) -> float:
        """Approximate duration of the study with `workers` workers; known geometries cost almost nothing."""
        fresh = self.geometries - 1 if self.geometries > 1 or self.cached else 0
        return (fresh * self.per_geometry + self.designs * self.per_design) / workers


def price(study: Study, say: Callable[[str], None]) -> Price:
    """Measure the middle geometry and a few of its designs; the results stay in the cache."""
    places = study.places
    designs, geometries = sampling.count(study)
    base = with_sites(study.finger, places)
    measure_base(base, 1, say)
    say("reducing one geometry")
    began = perf_counter()
    tried = [study.finger_of(free) for _, free in zip(range(TRIED), probes(study), strict=False)]
    first = with_sites(tried[0], places)
    known = geometry_map(first, places, base)
    took = perf_counter() - began
    cached = took < 1.0
    began = perf_counter()
    for finger in tried:
        judged(DesignInScene(finger, known, study.scene), study.asked)
    each = (perf_counter() - began) / len(tried)
    return Price(designs, geometries, len(first.gauges), each, took, cached)
