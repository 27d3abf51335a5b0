"""Processor time of a worker by stage; time that other programs use on a busy machine does not count."""

from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from time import process_time

GEOMETRY, RATIO, GAUGES, SCENES = "geometry", "ratio", "gauges", "scenes"
"""Stages: mesh and reductions; presses and the polynomial through them; sums over sites; surfaces and touches."""
SPENT: defaultdict[str, float] = defaultdict(float)
"""Processor seconds of this process in each stage but the last, since a batch began."""


@contextmanager
def spent_on(stage: str) -> Iterator[None]:
    """Add what is done inside to a stage; stages are not nested."""
    began = process_time()
    try:
        yield
    finally:
        SPENT[stage] += process_time() - began
