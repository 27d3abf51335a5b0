"""The study file: parameters, objectives and sampling. Every fault is reported in one line before anything runs."""

import hashlib
import math
import reprlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from papilla.core.checks import ROUNDING_SHARE
from papilla.core.errors import FileFormatError, InputError
from papilla.core.file_models import first_of, in_words, keys_of, table
from papilla.core.outside import read_toml
from papilla.design.formulas import coupled, names_of
from papilla.design.geometry import MakesMap, geometry_map, with_sites
from papilla.design.in_scene import DesignInScene
from papilla.design.objectives import OBJECTIVES_BY_NAME, Objective
from papilla.design.parameters import made, of_geometry, parameters_of, refuse_unknown
from papilla.design.places import Places, foil_of
from papilla.design.scene import DesignScene, Tolerances, Unknowns
from papilla.design.texts import short
from papilla.estimators.softness import Doubts
from papilla.model.finger import SHIPPED_FINGERS, Finger

SCENE_TABLES = ("unknown", "tolerances")
"""Parts of a scene that are tables of their own in the file."""
DEFAULT_GRID_LEVELS = 5
"""Number of values of a range in a grid, unless its table states `levels`."""
MOST_DESIGNS, MOST_GEOMETRIES, MOST_SEED = 10**7, 10**4, 2**32 - 1
"""Most designs and geometries of a study, and the largest seed of its sampler."""
MOST_VALUES, MOST_FREE, MOST_GIVEN, MOST_CONFIRMED = 1000, 50, 200, 10
"""Most values of a parameter in a grid, free parameters, fixed or coupled ones, and calibrations at the end."""
STUDY_NAME_LETTERS, STUDY_PATH_LETTERS = 200, 1000
"""Most letters of a name or key, and of the name of a file, in a study file."""


@dataclass(frozen=True)
class Free:
    """A varied parameter: between two values, evenly or in the logarithm, or among some (`values`)."""

    name: str
    low: float
    high: float
    log: bool
    levels: int
    values: tuple[float, ...] = ()

    def at(self, share: float) -> float:
        """The value at a share from 0 to 1 of the range."""
        if self.values:
            return self.values[min(int(share * len(self.values)), len(self.values) - 1)]
        return self.low * (self.high / self.low) ** share if self.log else self.low + share * (self.high - self.low)

    def share(self, value: float) -> float:
        """The share of the range at which a value lies."""
        low, high, at = (math.log(number) if self.log else number for number in (self.low, self.high, value))
        return (at - low) / (high - low) if high > low else 0.0

    @property
    def grid(self) -> list[float]:
        """The values in a grid."""
        return [*self.values] or [self.at(k / (self.levels - 1)) for k in range(self.levels)]

    def holds(self, value: float) -> bool:
        """Whether the parameter may have a value, apart from rounding at the ends of the range."""
        if self.values:
            return value in self.values
        beyond = ROUNDING_SHARE * max(abs(self.low), abs(self.high))
        return self.low - beyond <= value <= self.high + beyond


def at_shares(free: Sequence[Free], shares: Iterable[float]) -> dict[str, float]:
    """Values of free parameters at shares of their ranges, by name."""
    return {parameter.name: parameter.at(share) for parameter, share in zip(free, shares, strict=True)}


@dataclass(frozen=True)
class Limit:
    """A constraint: an objective between `least` and `most`."""

    least: float = -math.inf
    most: float = math.inf


@dataclass(frozen=True)
class Sampler:
    """How designs are drawn. kind : "grid", "sobol" (scipy.stats.qmc) or "optimise" (scipy's differential evolution).

    designs : number in a Sobol sample, or largest number of an optimiser. geometries : number in a Sobol sample with
    free shapes. seed : of both.
    """

    kind: Literal["grid", "sobol", "optimise"] = "sobol"
    designs: int = 256
    geometries: int = 8
    seed: int = 0


@dataclass(frozen=True)
class Study:
    """A study as its file states it. values : of the finger, by parameter; free parameters have a range instead.
    geometry : makes the map of a geometry, as `geometry_map` does; workers must be able to import it."""

    name: str
    finger: Finger
    free: tuple[Free, ...]
    fixed: Mapping[str, float]
    couplings: Mapping[str, str]
    scene: DesignScene
    objectives: tuple[Objective, ...]
    limits: Mapping[str, Limit]
    sampler: Sampler
    confirm: int
    store: Path | None
    sha256: str
    geometry: MakesMap = geometry_map

    @property
    def free_names(self) -> list[str]:
        """Names of the free parameters."""
        return [parameter.name for parameter in self.free]

    @property
    def middle(self) -> dict[str, float]:
        """Values of the free parameters in the middle of their ranges."""
        return at_shares(self.free, [0.5] * len(self.free))

    @property
    def outer(self) -> list[Free]:
        """Free parameters that change the geometry, directly or by a coupling."""
        names = {parameter.name for parameter in self.free if of_geometry(parameter.name)}
        for name, formula in self.couplings.items():
            if of_geometry(name):
                names |= set(names_of(formula, name))
        return [parameter for parameter in self.free if parameter.name in names]

    @property
    def most_designs(self) -> int:
        """Number of designs of a grid or sample, or the most that an optimiser may try."""
        if self.sampler.kind == "grid":
            return math.prod(len(parameter.values) or parameter.levels for parameter in self.free)
        # An optimiser needs two generations of five designs at least
        return max(self.sampler.designs, 10) if self.sampler.kind == "optimise" else self.sampler.designs

    def check_free(self, free: Mapping[str, float]) -> None:
        """Raise `InputError` unless the values are those of the free parameters, inside their ranges."""
        if set(free) != set(self.free_names):
            raise InputError(f"its free parameters are not those of the study, {', '.join(self.free_names)}")
        for varied in self.free:
            value, low, high = free[varied.name], varied.low, varied.high
            if not varied.holds(value):
                raise InputError(f"{varied.name} = {value:g} is outside the study's {low:g} to {high:g}")

    @property
    def asked(self) -> tuple[str, ...]:
        """Names of all objectives that are computed, including those of constraints; sorted."""
        return tuple(sorted({objective.name for objective in self.objectives} | set(self.limits)))

    def finger_of(self, free: Mapping[str, float]) -> Finger:
        """The finger with these values of the free parameters, with fixed and coupled ones; raises `InputError`."""
        return made(self.finger, coupled({**self.fixed, **free}, self.couplings))

    @property
    def places(self) -> Places:
        """The places of gauges that the study needs: those of its gauges, a row, or the whole interface."""
        names = [*self.free_names, *self.couplings]
        places = (".angle_deg", ".y_mm", ".direction_deg", "gauges.count", "gauges.spread_deg")
        if "worst_over_tolerances" not in self.asked and not any(name.endswith(places) for name in names):
            return Places.of(self.finger_of(self.middle))
        foil, names = foil_of(self.finger.gauges), [*names, *self.fixed]
        off_row = any(gauge.y_mm or gauge.direction_deg for gauge in self.finger.gauges)
        varied = any(name.endswith((".y_mm", ".direction_deg")) and name.startswith("gauges") for name in names)
        return Places.whole(foil) if off_row or varied else Places.row(foil)

    def in_scene(self, finger: Finger) -> DesignInScene:
        """A finger in the scene of the study, with the study's places."""
        places = self.places
        base, with_places = with_sites(self.finger, places), with_sites(finger, places)
        return DesignInScene(finger, self.geometry(with_places, places, base), self.scene)

    def feasible(self, found: Mapping[str, float]) -> bool:
        """Whether values of objectives meet all limits."""
        return all(limit.least <= found[name] <= limit.most for name, limit in self.limits.items())


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class _Range(_Model):
    low: float | None = None
    high: float | None = None
    log: bool | None = None
    levels: int = Field(DEFAULT_GRID_LEVELS, ge=2, le=MOST_VALUES)
    values: list[float] | None = Field(None, min_length=1, max_length=MOST_VALUES)


def _doubted(friction: Any, **doubts: Any) -> tuple[Any, Doubts]:
    """The table `[doubts]`: the friction, None if it is not stated, and the estimators' `Doubts`."""
    return friction, Doubts(**doubts)


_LIMIT = table(Limit, keys_of(Limit), strict_keys=True)
_DOUBTS = table(_doubted, keys_of(Doubts) | {"friction": (Any, None)}, strict_keys=True)
_SAMPLER = table(Sampler, keys_of(Sampler), strict_keys=True)
_SCENE = table(
    DesignScene, {key: kind for key, kind in keys_of(DesignScene).items() if key not in SCENE_TABLES}, strict_keys=True
)
_TOLERANCES = table(Tolerances, keys_of(Tolerances), strict_keys=True)


class _File(_Model):
    name: str = Field(min_length=1, max_length=STUDY_NAME_LETTERS)
    finger: str = Field("default", min_length=1, max_length=STUDY_PATH_LETTERS)
    objectives: list[str] = Field(min_length=1, max_length=len(OBJECTIVES_BY_NAME))
    free: dict[str, list[float] | _Range] = Field(min_length=1, max_length=MOST_FREE)
    fixed: dict[str, float] = Field({}, max_length=MOST_GIVEN)
    couplings: dict[str, str] = Field({}, max_length=MOST_GIVEN)
    constraints: dict[str, _LIMIT] = {}  # type: ignore[valid-type]
    scene: _SCENE = DesignScene()  # type: ignore[valid-type]
    doubts: _DOUBTS = (None, Doubts())  # type: ignore[valid-type]
    tolerances: _TOLERANCES = Tolerances()  # type: ignore[valid-type]
    sampler: _SAMPLER = Sampler()  # type: ignore[valid-type]
    confirm: int = Field(0, ge=0, le=MOST_CONFIRMED)
    store: str | None = Field(None, min_length=1, max_length=STUDY_PATH_LETTERS)


def read_study(path: Path) -> Study:
    """The study of a file; raises `FileAccessError`, or `FileFormatError` in one line that names file and key."""
    content = read_toml(path, "study file")
    try:
        _check_names(content)
        for key in content:
            refuse_unknown(key, _File.model_fields, "study")
        file = _File.model_validate(content)
        return _study(file, path)
    except ValidationError as error:
        problem = first_of(error)
        where, key = (*map(str, problem["loc"]), "", "")[:2]
        words = in_words(problem, ("list[float]", "_Range"))
        if where == "scene" and key in ("force_N", "modulus_MPa"):
            words = f"scene.{key} must be [low, high], two finite numbers, got {content['scene'][key]!r}"
        raise FileFormatError(f"{path}: {words}") from error
    except InputError as error:
        raise FileFormatError(str(error) if str(path) in str(error) else f"{path}: {error}") from error


def _check_names(content: dict) -> None:
    """Raise `InputError` for a key or a name that cannot be printed whole on one line."""
    for keys in (content, *(value for value in content.values() if isinstance(value, dict))):
        for key in keys:
            if len(key) > STUDY_NAME_LETTERS or not key.isprintable():
                raise InputError(
                    f"a key must have at most {STUDY_NAME_LETTERS} letters, all printable, got {reprlib.repr(key)}"
                )
    name = content.get("name")
    if isinstance(name, str) and not name.isprintable():
        raise InputError(f"name must be of letters that can be printed, got {reprlib.repr(name)}")


def _study(file: _File, path: Path) -> Study:
    finger = Finger.load(file.finger if file.finger in SHIPPED_FINGERS else path.parent / file.finger)
    names = [*file.free, *file.fixed, *file.couplings]
    parameters = parameters_of(finger, names)
    for where in ("free", "fixed", "couplings"):
        for name in getattr(file, where):
            refuse_unknown(name, parameters, where)
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise InputError(f"{twice!r} stands in two of free, fixed and couplings")
    values = _values_of(finger)
    for name, formula in file.couplings.items():
        where = f'couplings."{name}"'
        for used in names_of(formula, where):
            refuse_unknown(used, [*values, *names], where)
    if len(set(file.objectives)) < len(file.objectives):
        raise InputError(f"objectives must differ, got {', '.join(map(short, file.objectives))}")
    for name in (*file.objectives, *file.constraints):
        refuse_unknown(name, OBJECTIVES_BY_NAME, "objectives" if name in file.objectives else "constraints")
    free = tuple(_free(name, stated) for name, stated in file.free.items())
    needed = {name for formula in file.couplings.values() for name in names_of(formula, "couplings")}
    fixed = {name: values[name] for name in needed if name not in names} | file.fixed
    text = repr((file, finger.sha256))
    study = Study(
        file.name,
        finger,
        free,
        fixed,
        file.couplings,
        _scene(file, finger),
        tuple(OBJECTIVES_BY_NAME[name] for name in file.objectives),
        file.constraints,
        file.sampler,
        file.confirm,
        path.parent / file.store if file.store else None,
        hashlib.sha256(text.encode()).hexdigest(),
    )
    _check(study)
    return study


def _values_of(finger: Finger) -> dict[str, float]:
    """Values of a finger that couplings may use although the study does not set them."""
    values = {f"{name}.modulus_MPa": getattr(finger, name).modulus for name in ("outer", "inner")}
    values |= {f"{name}.nu": getattr(finger, name).nu for name in ("outer", "inner")}
    for surface in ("outer", "interface", "bone"):
        axes = getattr(finger.shape, surface)
        values |= {
            f"shape.{surface}.{a}_mm": value for a, value in zip("xyz" if len(axes) == 3 else "xz", axes, strict=True)
        }
    return values


def _scene(file: _File, finger: Finger) -> DesignScene:
    friction, doubts = file.doubts  # type: ignore[attr-defined]
    if doubts.thickness_mm is None:
        doubts = replace(doubts, thickness_mm=float(finger.bench.thickness))
    if friction is None:
        friction = "unknown" if finger.bench.friction is None else finger.bench.friction
    return replace(file.scene, unknown=Unknowns(friction, doubts), tolerances=file.tolerances)


def _free(name: str, stated: "list[float] | _Range") -> Free:
    """A free parameter of `[low, high]`, or of a table with low and high, or with values."""
    span = (
        _Range(low=stated[0], high=stated[1], levels=DEFAULT_GRID_LEVELS, values=None)
        if isinstance(stated, list) and len(stated) == 2
        else stated
    )
    if isinstance(span, list):
        raise InputError(
            f"free.{name!r} must be [low, high] or a table, got {span!r}; some values are {{ values = ... }}"
        )
    if span.values:
        return Free(name, min(span.values), max(span.values), False, len(span.values), tuple(span.values))
    if span.low is None or span.high is None or not span.low < span.high:
        raise InputError(f"free.{name!r} has an empty range, {span.low} to {span.high}: low must be below high")
    log = span.low > 0 and name.endswith("modulus_MPa") if span.log is None else span.log
    if log and span.low <= 0:
        raise InputError(f"free.{name!r}: log = true needs a range above 0, got {span.low} to {span.high}")
    return Free(name, span.low, span.high, log, span.levels)


def _check(study: Study) -> None:
    """Raise `InputError` if the middle design, or one with a single parameter at an end of its range, is impossible:
    layers that cross, gauges outside the interface, too few gauges for an objective."""
    sampler = study.sampler
    for name, value, least, most in (
        ("sampler.designs", sampler.designs, 1, MOST_DESIGNS),
        ("sampler.geometries", sampler.geometries, 1, MOST_GEOMETRIES),
        ("sampler.seed", sampler.seed, 0, MOST_SEED),
        ("number of designs of the grid", study.most_designs, 1, MOST_DESIGNS),
    ):
        if not least <= value <= most:
            size = value if abs(value) < 10**20 else f"{math.log10(abs(value)):.0f} digits"
            raise InputError(f"{name} must be from {least} to {most}, got {size}")
    for free in probes(study):
        finger, words = None, ", ".join(f"{name} = {value:.4g}" for name, value in free.items())
        try:
            finger = study.finger_of(free)
            study.places.weights(finger.gauges, finger.shape)
        except InputError as error:
            raise InputError(f"the design {words}: {error}") from error
        if poor := next(
            (OBJECTIVES_BY_NAME[name] for name in study.asked if OBJECTIVES_BY_NAME[name].gauges > len(finger.gauges)),
            None,
        ):
            raise InputError(f"{poor.name} needs {poor.gauges} gauges, the design {words} has {len(finger.gauges)}")


def probes(study: Study) -> Iterator[dict[str, float]]:
    """The middle design, and those with one parameter at an end of its range."""
    middle = study.middle
    yield middle
    for parameter in study.free:
        for end in (0.0, 1.0):
            yield middle | {parameter.name: parameter.at(end)}
