"""Which rung `fidelity="auto"` takes, and what it says of it.

Rung hertz is measured against contact for the very finger and specimen. What contact itself is off by, for the mesh and
for small strain, both rungs share: it is looked up among the figures of `papilla bench` (`prices`), told, and never
measured here, because a press at finite strain takes ten thousand times as long as one without.
"""

from dataclasses import dataclass
from functools import lru_cache
from time import perf_counter

import numpy as np

from papilla.errors import ContactRangeError
from papilla.fem.pressing.contact import contact_press
from papilla.fem.pressing.hertz import hertz_press
from papilla.fem.pressing.hertz_table import hertz_table
from papilla.fem.pressing.prices import QUANTITIES, Prices, known_prices
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.specimen import Specimen

NAMES = dict(zip(QUANTITIES, ("S_d", "indentation", "contact area"), strict=True))
"""The quantities that `auto` holds to its tolerance, in words."""

NEARLY_HERTZIAN = 0.1
"""Measured error of the hertz rung at the lightest resolved press, up to which `auto` trusts it with lighter ones."""

PROBE_FORCES = np.geomspace(0.02, 1.0, 6)
"""Forces (N) at which the hertz rung is measured against contact."""


@dataclass(frozen=True)
class Worst:
    """The largest of the relative errors of several quantities, and which quantity has it."""

    error: float
    quantity: str

    @classmethod
    def of(cls, errors: dict[str, float]) -> "Worst":
        """Of errors by quantity."""
        quantity = max(errors, key=lambda name: errors[name])
        return cls(float(errors[quantity]), quantity)

    def __str__(self) -> str:
        return f"{100 * self.error:.1f} % in {NAMES[self.quantity]}"


def hertz_error(
    reduced: ReducedFinger, specimen: Specimen, force: float | None, indentation: float | None
) -> Worst | None:
    """Measured error of the hertz rung around a force (N) or indentation (mm); None where contact cannot tell.

    It is what hertz is off by from contact, and on top of it what contact is known to be off by for the mesh: where the
    mesh takes a share of the tolerance, only the rest is hertz's.
    """
    if indentation is not None:
        try:
            table = hertz_table(reduced, specimen)
        except ContactRangeError:
            return None
        force = float(np.interp(indentation, table.indentation, table.force))
    assert force is not None
    if not PROBE_FORCES[0] <= force <= PROBE_FORCES[-1]:
        return None
    right = int(np.clip(np.searchsorted(PROBE_FORCES, force), 1, len(PROBE_FORCES) - 1))
    around = probe_hertz(reduced, specimen)[right - 1 : right + 1].max(axis=0)
    if not np.isfinite(around).all():
        return None
    prices = _prices(reduced)
    mesh = [0.0 if prices is None else prices.mesh.at(force, name) or 0.0 for name in QUANTITIES]
    return Worst.of(dict(zip(QUANTITIES, around + mesh, strict=True)))


def lightest_error(reduced: ReducedFinger, specimen: Specimen) -> Worst | None:
    """Measured error of the hertz rung at the lightest probe that contact resolves; None where none is."""
    errors = probe_hertz(reduced, specimen)
    resolved = errors[np.isfinite(errors).all(axis=1)]
    return Worst.of(dict(zip(QUANTITIES, resolved[0], strict=True))) if len(resolved) else None


@lru_cache(maxsize=256)
def probe_hertz(reduced: ReducedFinger, specimen: Specimen) -> np.ndarray:
    """Relative errors (probes, quantities) of the hertz rung against contact at `PROBE_FORCES`; infinite where contact
    does not resolve the press."""
    errors, start = np.full((len(PROBE_FORCES), len(QUANTITIES)), np.inf), None
    for k, force in enumerate(PROBE_FORCES):
        try:
            truth = contact_press(reduced, specimen, float(force), None, start, perf_counter())
            scene = hertz_press(reduced, specimen, float(force), None, "", perf_counter())
        except ContactRangeError:
            break
        start = truth.active
        if truth.resolved:
            errors[k] = [abs(getattr(scene, name) / getattr(truth, name) - 1) for name in QUANTITIES]
    return errors


def shared_losses(reduced: ReducedFinger, force: float, tolerance: float) -> str:
    """What both linear rungs are known to be off by at a force (N), in words that follow a sentence."""
    prices = _prices(reduced)
    if prices is None:
        where = "off the apex" if reduced.at != (0.0, 0.0) else "of this finger and mesh (papilla bench measures it)"
        return f"; what mesh and small strain cost is not known {where}"
    parts = {name: _worst(getattr(prices, name), force) for name in ("mesh", "small_strain")}
    known = [f"{name.replace('_', ' ')} {worst}" for name, worst in parts.items() if worst is not None]
    if not known:
        return f"; what mesh and small strain cost is not known at {force:.3g} N"
    told = f"; known to be off by ({prices.specimen}): {', '.join(known)}"
    strain = parts["small_strain"]
    if strain is not None and strain.error > tolerance:
        told += f"; small strain alone is over {100 * tolerance:g} %: --fidelity finite (press_finite) has none of it"
    return told


def _prices(reduced: ReducedFinger) -> Prices | None:
    """What is known of the rungs of a finger on its mesh: all of it at the apex."""
    return known_prices(reduced.finger_sha256, reduced.mesh_sha256) if reduced.at == (0.0, 0.0) else None


def _worst(loss, force: float) -> Worst | None:
    errors = {name: loss.at(force, name) for name in QUANTITIES}
    return None if None in errors.values() else Worst.of(errors)
