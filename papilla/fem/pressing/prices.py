"""Known errors and costs of each fidelity, for one finger on one mesh. They are measured once; `fidelity="auto"` reads
them.

`pricing` measures them (`papilla bench` calls it), and the cache keeps them by the content of finger, mesh and code.
Those of the default finger on its shipped mesh ship with the package.
"""

from dataclasses import asdict
from functools import lru_cache
from json import dumps
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import ConfigDict, TypeAdapter
from pydantic.dataclasses import dataclass

from papilla.core import cache
from papilla.core.errors import InputError
from papilla.core.outside import read_bytes
from papilla.model.finger import DEFAULT_FINGER

PRICED_QUANTITIES = ("sd", "indentation", "contact_area")  # Quantities whose errors are known
PRICING_MODULE = "papilla.fem.pressing.pricing"  # Module whose code determines the prices in the cache
SHIPPED_PRICES = DEFAULT_FINGER.parent / "default_prices.json"

STRICT_CONFIG = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


@dataclass(frozen=True, config=STRICT_CONFIG)
class Loss:
    """Errors of one answer against a better one: relative, signed, at each of `forces` (N), which rise."""

    forces: tuple[float, ...]
    sd: tuple[float, ...]
    indentation: tuple[float, ...]
    contact_area: tuple[float, ...]

    def __post_init__(self):
        """Refuse fewer than two forces, forces that do not rise, and missing errors."""
        lengths = {len(values) for values in (self.forces, self.sd, self.indentation, self.contact_area)}
        if len(lengths) != 1 or len(self.forces) < 2 or list(self.forces) != sorted(set(self.forces)):
            raise InputError("two forces at least must rise, each with an error in each quantity")

    def at(self, force: float, quantity: str) -> float | None:
        """The larger error, without sign, of a quantity at the two measured forces around `force` (N); None outside of
        all measured forces."""
        if not self.forces[0] <= force <= self.forces[-1]:
            return None
        right = max(1, next(k for k, measured in enumerate(self.forces) if force <= measured))
        return max(abs(error) for error in getattr(self, quantity)[right - 1 : right + 1])


@dataclass(frozen=True, config=STRICT_CONFIG)
class Cost:
    """Seconds that a fidelity takes: once before the first press (assembly, factorisation, reduction), and for each
    press."""

    seconds_setup: float
    seconds_per_scene: float


@dataclass(frozen=True, config=STRICT_CONFIG)
class Prices:
    """Errors and costs of the fidelities of one finger on one mesh.

    specimen : what was pressed, in words; it is the same in all measurements.
    hertz : error of hertz against contact, None if hertz has no answer on this mesh.
    mesh : error of contact against contact with elements of `finest_size_mm`.
    small_strain : error of contact against finite.
    costs : fidelity -> seconds, on the machine that measured.
    """

    finger_name: str
    finger_sha256: str
    mesh_sha256: str
    mesh_size_mm: float
    finest_size_mm: float
    specimen: str
    hertz: Loss | None
    mesh: Loss
    small_strain: Loss
    costs: dict[str, Cost]
    schema: Literal["papilla.prices/1"] = "papilla.prices/1"

    def to_json(self) -> str:
        """The prices as JSON text."""
        return dumps(asdict(self), indent=1, allow_nan=False) + "\n"


PRICES_FORMAT = TypeAdapter(Prices)
"""Reads the JSON text of prices: `validate_json` raises `ValidationError` for any other."""


def keep(prices: Prices) -> None:
    """Store prices in the cache, for `known_prices`."""
    key = cache.key(PRICING_MODULE, prices.finger_sha256, prices.mesh_sha256)
    cache.keep("prices", key, {"json": np.array(prices.to_json())})
    _found.cache_clear()


def known_prices(finger_sha256: str, mesh_sha256: str) -> Prices | None:
    """The prices of a finger on a mesh, from the cache or from the package; None if nobody has measured them.

    Cached prices of other code do not count. Damaged ones cause a warning and are ignored.
    """
    return _found(finger_sha256, mesh_sha256, cache.folder())


@lru_cache(maxsize=64)
def _found(finger_sha256: str, mesh_sha256: str, _folder: Path) -> Prices | None:
    cached = cache.find("prices", cache.key(PRICING_MODULE, finger_sha256, mesh_sha256), report=True)
    prices = PRICES_FORMAT.validate_json(read_bytes(SHIPPED_PRICES) if cached is None else str(cached["json"]))
    return prices if (prices.finger_sha256, prices.mesh_sha256) == (finger_sha256, mesh_sha256) else None
