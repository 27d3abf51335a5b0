"""The work of a worker: a batch of designs of one geometry; each gives a record of its objectives or of the reason for
failure."""

import re
import resource
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache as once
from time import process_time

from papilla import __version__
from papilla.core import cache, checks
from papilla.core.errors import InputError, PapillaError
from papilla.design.geometry import STAGE_SCENES, STAGE_SECONDS, MakesMap, geometry_map, with_sites
from papilla.design.in_scene import DesignInScene
from papilla.design.objectives import OBJECTIVES_BY_NAME
from papilla.design.places import Places
from papilla.design.scene import DesignScene
from papilla.design.texts import line, short
from papilla.model.finger import Finger

STATUS_OK = "ok"
SHA256_PATTERN = re.compile("[0-9a-f]{64}")


STATUS_LETTERS = 2000
"""Most letters of the reason why a design has no answer."""


@dataclass(frozen=True)
class JudgedDesign:
    """Result of a design: objective -> value, "ok" or the reason for failure, and the `sha256` of the finger that was
    judged; empty if these values of the parameters make no finger."""

    found: dict[str, float]
    status: str
    finger_sha256: str = ""

    @classmethod
    def failed(cls, why: object, finger_sha256: str = "") -> "JudgedDesign":
        """The record of a design without an answer."""
        return cls({}, short(line(why), STATUS_LETTERS) or "no reason is known", finger_sha256)

    def check(self, asked: Sequence[str]) -> None:
        """Raise `InputError` unless this may be a record of these objectives: it may come from a store or a worker."""
        if (
            not isinstance(self.status, str)
            or not self.status.isprintable()
            or not 0 < len(self.status) <= STATUS_LETTERS
        ):
            raise InputError(f"its status is no line of at most {STATUS_LETTERS} letters")
        judged = isinstance(self.finger_sha256, str) and SHA256_PATTERN.fullmatch(self.finger_sha256)
        if not judged and (self.status == STATUS_OK or self.finger_sha256 != ""):
            raise InputError("the finger that was judged has no sha256")
        expected = set(asked) if self.status == STATUS_OK else set()
        if not isinstance(self.found, dict) or set(self.found) != expected:
            raise InputError(f"with the status {short(self.status)!r} it must have {len(expected)} values, those of "
                             f"{', '.join(sorted(expected)) or 'no objective'}")  # fmt: skip
        for name, value in self.found.items():
            checks.finite(name, value)


@dataclass(frozen=True)
class Batch:
    """Fingers of one geometry, in a scene. base : the finger whose large strain all geometries use; geometry : makes
    its map."""

    fingers: tuple[Finger, ...]
    base: Finger
    places: Places
    scene: DesignScene
    asked: tuple[str, ...]
    version: str
    geometry: MakesMap = geometry_map


@dataclass(frozen=True)
class Done:
    """Records of a batch; the version that made them, processor seconds by stage of `geometry`, and the largest memory
    of the worker (MB) so far."""

    records: tuple[JudgedDesign, ...]
    version: str
    spent: dict[str, float]
    memory_MB: float


def check_done(report: object, batch: Batch) -> None:
    """Raise `InputError` unless this may be what a worker with this version made of a batch."""
    if not isinstance(report, Done) or not isinstance(report.version, str):
        raise InputError(f"a worker sent {short(line(type(report).__name__))}, not the records of a batch")
    if report.version != version():
        refuse_version("a worker", report.version)
    if not isinstance(report.records, tuple) or len(report.records) != len(batch.fingers):
        raise InputError(f"a worker did not send one record for each of {len(batch.fingers)} designs")
    for record, finger in zip(report.records, batch.fingers, strict=True):
        if not isinstance(record, JudgedDesign):
            raise InputError(f"a worker sent {short(line(type(record).__name__))} as a record")
        try:
            record.check(batch.asked)
        except InputError as error:
            raise InputError(f"a worker sent a record that cannot be used: {error}") from error
        if record.finger_sha256 != finger.sha256:
            raise InputError("a worker judged another finger than the one it was sent")
    for name, seconds in (*dict(report.spent).items(), ("memory_MB", report.memory_MB)):
        checks.finite(short(line(name)), seconds)


def refuse_version(who: str, version_there: str) -> None:
    """Raise `InputError` if a worker has another version."""
    if version_there != version():
        there = short(line(version_there))
        raise InputError(f"{who} has papilla {there}, this client has {version()}: install the same on all machines")


@once
def version() -> str:
    """The version of papilla and a hash of all code that determines a record."""
    return f"{__version__} ({cache.key(__name__)[:12]})"


def evaluate(batch: Batch) -> Done:
    """The records of a batch; empty for a batch of another version, which a worker with that version must do."""
    if batch.version != version():
        return Done((), version(), {}, 0.0)
    began = process_time()
    STAGE_SECONDS.clear()
    try:
        first, base = with_sites(batch.fingers[0], batch.places), with_sites(batch.base, batch.places)
        geometry = batch.geometry(first, batch.places, base)
    except PapillaError as error:
        records = [JudgedDesign.failed(error, finger.sha256) for finger in batch.fingers]
        return Done(tuple(records), version(), dict(STAGE_SECONDS), _memory_MB())
    records = [judged(DesignInScene(finger, geometry, batch.scene), batch.asked) for finger in batch.fingers]
    rest = process_time() - began - sum(STAGE_SECONDS.values())
    return Done(tuple(records), version(), {**STAGE_SECONDS, STAGE_SCENES: rest}, _memory_MB())


def judged(design: DesignInScene, asked: Sequence[str]) -> JudgedDesign:
    """The objectives of a design, or the reason for failure."""
    try:
        values = {name: checks.finite(name, OBJECTIVES_BY_NAME[name].of(design)) for name in asked}
    except PapillaError as error:
        return JudgedDesign.failed(error, design.finger.sha256)
    return JudgedDesign(values, STATUS_OK, design.finger.sha256)


def _memory_MB() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
