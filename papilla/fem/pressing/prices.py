"""What each rung is known to be off by, and costs, for one finger on one mesh: measured once, read by `auto`.

Figures come from `pricing` (`papilla bench` calls it) and lie in the cache, by the content of finger,
mesh and code. Those of the default finger on the mesh that ships with the package ship beside it.
"""

import json
import math
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from papilla import cache
from papilla.errors import FileAccessError, FileFormatError
from papilla.files import write_text
from papilla.finger import DEFAULT_FINGER

SCHEMA = "papilla.prices/1"

QUANTITIES = ("sd", "indentation", "contact_area")
"""What errors are known of."""

MEASURED_BY = "papilla.fem.pressing.pricing"
"""Module whose code stands behind prices in the cache."""

SHIPPED = DEFAULT_FINGER.parent / "default_prices.json"


@dataclass(frozen=True)
class Loss:
    """What one answer is off by against a better one: relative errors, signed, at each of `forces` (N), rising."""

    forces: tuple[float, ...]
    sd: tuple[float, ...]
    indentation: tuple[float, ...]
    contact_area: tuple[float, ...]

    def at(self, force: float, quantity: str) -> float | None:
        """The larger size of the error at the two measured forces around `force` (N); None outside of them all."""
        if not self.forces[0] <= force <= self.forces[-1]:
            return None
        right = max(1, next(k for k, measured in enumerate(self.forces) if force <= measured))
        return max(abs(error) for error in getattr(self, quantity)[right - 1 : right + 1])


@dataclass(frozen=True)
class Cost:
    """Seconds of a rung: before its first scene (assembly, factorisation, reduction), and for each."""

    seconds_setup: float
    seconds_per_scene: float


@dataclass(frozen=True)
class Prices:
    """What is known of the rungs of one finger on one mesh.

    specimen : what was pressed, in words; it is the same in all measurements.
    hertz : rung hertz against rung contact; mesh : rung contact against itself with elements of `finest_size_mm`;
    small_strain : rung contact against rung finite.
    costs : rung -> seconds, on the machine that measured.
    """

    finger_name: str
    finger_sha256: str
    mesh_sha256: str
    mesh_size_mm: float
    finest_size_mm: float
    specimen: str
    hertz: Loss
    mesh: Loss
    small_strain: Loss
    costs: dict[str, Cost]

    def save(self, path) -> None:
        """Write the prices as JSON, atomically; raises `FileAccessError`."""
        write_text(path, self.to_json())

    def to_json(self) -> str:
        """The prices as JSON text."""
        return json.dumps({"schema": SCHEMA, **asdict(self)}, indent=1, allow_nan=False) + "\n"

    @classmethod
    def load(cls, path) -> "Prices":
        """Prices that `save` wrote; raises `FileAccessError`, or `FileFormatError` for anything else."""
        try:
            return _read(json.loads(Path(path).read_text(encoding="utf-8")))
        except OSError as error:
            raise FileAccessError(f"cannot read prices {path}: {error.strerror}") from error
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            raise FileFormatError(f"{path} does not hold prices of a finger ({error})") from error


def keep(prices: Prices) -> None:
    """Store prices in the cache, for `known_prices`."""
    key = cache.key(MEASURED_BY, prices.finger_sha256, prices.mesh_sha256)
    cache.keep("prices", key, {"json": np.array(prices.to_json())})
    _found.cache_clear()


def known_prices(finger_sha256: str, mesh_sha256: str) -> Prices | None:
    """The prices of a finger on a mesh: those in the cache, else those that ship; None where nobody measured them.

    Cached ones of other code do not count. Damaged ones are reported by a warning and count as none.
    """
    return _found(finger_sha256, mesh_sha256, cache.folder())


@lru_cache(maxsize=64)
def _found(finger_sha256: str, mesh_sha256: str, _folder: Path) -> Prices | None:
    kept = cache.find("prices", cache.key(MEASURED_BY, finger_sha256, mesh_sha256), report=True)
    prices = Prices.load(SHIPPED) if kept is None else _read(json.loads(str(kept["json"])))
    return prices if (prices.finger_sha256, prices.mesh_sha256) == (finger_sha256, mesh_sha256) else None


def _read(document: dict[str, Any]) -> Prices:
    if document.pop("schema") != SCHEMA:
        raise FileFormatError(f"the schema is not {SCHEMA}")
    for name in ("hertz", "mesh", "small_strain"):
        document[name] = _loss(document[name])
    document["costs"] = {rung: Cost(**_numbers(cost)) for rung, cost in document["costs"].items()}
    document |= _numbers({key: document[key] for key in ("mesh_size_mm", "finest_size_mm")})
    prices = Prices(**document)
    names = (prices.finger_name, prices.finger_sha256, prices.mesh_sha256, prices.specimen)
    if not all(isinstance(name, str) for name in names):
        raise FileFormatError("a name or a hash is not a text")
    return prices


def _loss(table: dict[str, list]) -> Loss:
    loss = Loss(**{key: tuple(_number(value) for value in values) for key, values in table.items()})
    if len({len(values) for values in vars(loss).values()}) != 1 or len(loss.forces) < 2:
        raise FileFormatError("each force needs an error in each quantity, and there are two forces at least")
    if list(loss.forces) != sorted(set(loss.forces)):
        raise FileFormatError("the forces do not rise")
    return loss


def _numbers(table: dict[str, Any]) -> dict[str, float]:
    return {key: _number(value) for key, value in table.items()}


def _number(value) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise FileFormatError(f"{value!r} is not a finite number")
    return float(value)
