"""The work of a worker: a batch of designs of one geometry; each gives a record of its objectives or of the reason for
failure."""

import resource
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache as once
from time import process_time

from papilla import __version__
from papilla.core import cache
from papilla.core.errors import PapillaError
from papilla.design.geometry import SCENES, SPENT, geometry_map, with_sites
from papilla.design.in_scene import DesignInScene
from papilla.design.objectives import OBJECTIVES
from papilla.design.places import Places
from papilla.design.scene import Scene
from papilla.model.finger import Finger

OK = "ok"


@dataclass(frozen=True)
class Record:
    """Result of a design: objective -> value, and "ok" or the reason for failure."""

    found: dict[str, float]
    status: str


@dataclass(frozen=True)
class Batch:
    """Fingers of one geometry, in a scene. base : the finger whose large strain all geometries use."""

    fingers: tuple[Finger, ...]
    base: Finger
    places: Places
    scene: Scene
    asked: tuple[str, ...]
    version: str


@dataclass(frozen=True)
class Done:
    """Records of a batch; the version that made them, processor seconds by stage of `geometry`, and the largest memory
    of the worker (MB) so far."""

    records: tuple[Record, ...]
    version: str
    spent: dict[str, float]
    memory_MB: float


@once
def version() -> str:
    """The version of papilla and a hash of all code that determines a record."""
    return f"{__version__} ({cache.key(__name__)[:12]})"


def evaluate(batch: Batch) -> Done:
    """The records of a batch; empty for a batch of another version, which a worker with that version must do."""
    if batch.version != version():
        return Done((), version(), {}, 0.0)
    began = process_time()
    SPENT.clear()
    try:
        first, base = with_sites(batch.fingers[0], batch.places), with_sites(batch.base, batch.places)
        known = geometry_map(first, batch.places, base)
    except PapillaError as error:
        return Done((Record({}, str(error)),) * len(batch.fingers), version(), dict(SPENT), _memory_MB())
    records = [judged(DesignInScene(finger, known, batch.scene), batch.asked) for finger in batch.fingers]
    rest = process_time() - began - sum(SPENT.values())
    return Done(tuple(records), version(), {**SPENT, SCENES: rest}, _memory_MB())


def judged(design: DesignInScene, asked: Sequence[str]) -> Record:
    """The objectives of a design, or the reason for failure."""
    try:
        return Record({name: OBJECTIVES[name].of(design) for name in asked}, OK)
    except PapillaError as error:
        return Record({}, str(error))


def _memory_MB() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
