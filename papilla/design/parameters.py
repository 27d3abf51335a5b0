"""The parameters of a design that a study may vary, by the names of the design file, and the finger that they make."""

import difflib
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from papilla.errors import InputError
from papilla.finger import Dome, Finger, Gauge, Layer, Slab

OF_GAUGE = ("angle_deg", "y_mm", "direction_deg", "membrane_gain", "lever_mm")
MOST_GAUGES = 16
"""Gauges of a row that a study may ask for."""

Change = Callable[[Finger, float], Finger]


def _scaled(finger: Finger, factor: float) -> Finger:
    """The whole body larger or smaller; gauges stay as large as they are, and keep their angles."""
    lengths: dict[str, Any] = {
        name: tuple(factor * one for one in value) if isinstance(value, tuple) else factor * value
        for name, value in vars(finger.shape).items()
    }
    gauges = tuple(replace(one, y_mm=factor * one.y_mm) for one in finger.gauges)
    ridges = finger.ridges and replace(
        finger.ridges, **{key: factor * value for key, value in vars(finger.ridges).items()}
    )
    resized = replace(finger, patch_radius=factor * finger.patch_radius, gauges=gauges, ridges=ridges)
    return _shaped(resized, **lengths)


def _axis(surface: str, number: int, finger: Finger, value: float) -> Finger:
    axes = list(getattr(finger.shape, surface))
    axes[number] = value
    return _shaped(finger, **{surface: tuple(axes)})


def _skin(finger: Finger, thickness: float) -> Finger:
    """The outer layer equally thick at all ends of the axes."""
    return _shaped(finger, interface=tuple(float(axis) - thickness for axis in finger.shape.outer))


def _depth(finger: Finger, value: float) -> Finger:
    return _shaped(finger, depth=value)


def _shaped(finger: Finger, **changed: Any) -> Finger:
    shape: Any = finger.shape
    return replace(finger, shape=replace(shape, **changed))


def _layer(name: str, key: str, finger: Finger, value: float) -> Finger:
    layer: Layer = getattr(finger, name)
    return replace(finger, **{name: replace(layer, **{key: value}, material=None)})  # type: ignore[arg-type]


def _row(finger: Finger, count: float) -> Finger:
    """So many gauges in a row at y = 0, as far out as the outermost one was."""
    number = round(count)
    if number != count or not 1 <= number <= MOST_GAUGES:
        raise InputError(f"gauges.count must be a whole number from 1 to {MOST_GAUGES}, got {count:g}")
    spread = max(abs(gauge.angle_deg or 0.0) for gauge in finger.gauges)
    first = replace(finger.gauges[0], x_mm=None, y_mm=0.0, direction_deg=0.0)
    return replace(finger, gauges=tuple(_placed(first, k, number, spread) for k in range(number)))


def _spread(finger: Finger, spread: float) -> Finger:
    count = len(finger.gauges)
    return replace(finger, gauges=tuple(_placed(one, k, count, spread) for k, one in enumerate(finger.gauges)))


def _placed(gauge: Gauge, k: int, count: int, spread: float) -> Gauge:
    angle = 0.0 if count == 1 else spread * (2 * k / (count - 1) - 1)
    return replace(gauge, name=f"g{k + 1}", angle_deg=angle, x_mm=None)


def _gauges(name: str | None, key: str, finger: Finger, value: float) -> Finger:
    """A value of one gauge, or of all."""
    changed = {key: value} | ({"x_mm": None} if key == "angle_deg" else {})
    return replace(
        finger,
        gauges=tuple(
            replace(one, **changed) if name in (None, one.name) else one  # type: ignore[arg-type]
            for one in finger.gauges
        ),
    )


def parameters_of(finger: Finger, more: Iterable[str] = ()) -> dict[str, Change]:
    """What may be varied of a finger, in the order in which it is applied: name -> change.

    more : names that a study uses; those of gauges of a longer row count as known.
    """
    if not isinstance(finger.shape, Dome | Slab):
        raise InputError("a study varies a dome or a slab: its finger is of surface files")
    found: dict[str, Change] = {"shape.scale": _scaled}
    axes = "xyz" if isinstance(finger.shape, Dome) else "xz"
    for surface in ("outer", "interface", "bone"):
        found |= {f"shape.{surface}.{axis}_mm": partial(_axis, surface, k) for k, axis in enumerate(axes)}
        if surface == "outer":
            found["shape.skin_mm"] = _skin
    if isinstance(finger.shape, Slab):
        found["shape.depth_mm"] = _depth
    for layer in ("outer", "inner"):
        found |= {
            f"{layer}.nu": partial(_layer, layer, "nu"),
            f"{layer}.modulus_MPa": partial(_layer, layer, "modulus"),
        }
    found |= {"gauges.count": _row, "gauges.spread_deg": _spread}
    found |= {f"gauges.{key}": partial(_gauges, None, key) for key in ("membrane_gain", "lever_mm")}
    names = [gauge.name for gauge in finger.gauges]
    names += [f"g{k + 1}" for k in range(MOST_GAUGES) if "gauges.count" in more and f"g{k + 1}" not in names]
    found |= {f"gauges.{name}.{key}": partial(_gauges, name, key) for name in names for key in OF_GAUGE}
    return found


def of_geometry(name: str) -> bool:
    """Whether a parameter needs another mesh and its reductions."""
    return name.startswith("shape.") or name.endswith(".nu")


def made(base: Finger, values: Mapping[str, float]) -> Finger:
    """The finger with these values of parameters; raises `InputError` where it cannot be (layers that cross)."""
    changes, finger = parameters_of(base, values), base
    for name, change in changes.items():
        if name in values:
            try:
                finger = change(finger, float(values[name]))
            except InputError as error:
                # A later one may put it right: layers cross while one axis after the other is set
                if not name.startswith("shape."):
                    raise InputError(f"{name} = {values[name]:g}: {error}") from error
                finger = _together(finger, changes, values)
                values = {key: value for key, value in values.items() if not key.startswith("shape.")}
    return replace(finger, identified=None)


def _together(finger: Finger, changes: Mapping[str, Change], values: Mapping[str, float]) -> Finger:
    """The finger with all axes of its shape set at once."""
    lengths = {key: list(value) for key, value in vars(finger.shape).items() if isinstance(value, tuple)}
    for name in changes:
        found = re.fullmatch(r"shape\.(outer|interface|bone)\.(\w)_mm", name)
        if name in values and found:
            number = list(changes).index(name) - list(changes).index(f"shape.{found[1]}.x_mm")
            lengths[found[1]][number] = values[name]
        elif name in values and name == "shape.skin_mm":
            lengths["interface"] = [axis - values[name] for axis in lengths["outer"]]
    return _shaped(finger, **{key: tuple(value) for key, value in lengths.items()})


def refuse_unknown(name: str, known: Iterable[str], where: str) -> None:
    """Raise `InputError` for a name that is not known, with the nearest one."""
    known = list(known)
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1, cutoff=0.4)
        raise InputError(f"{where}: unknown {name!r}" + (f", did you mean {near[0]!r}?" if near else ""))
