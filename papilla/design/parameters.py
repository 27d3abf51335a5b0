"""The parameters of a design that a study may vary, with the names of the design file, and the finger with values of
them."""

import difflib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from papilla.core.errors import InputError
from papilla.design.texts import MOST_PRINTED_LETTERS, short
from papilla.model.finger import Dome, Finger, Gauge, Layer, Slab

OF_GAUGE = ("angle_deg", "y_mm", "direction_deg", "membrane_gain", "lever_mm")
FINGER_SURFACES = ("outer", "interface", "bone")
MOST_ROW_GAUGES = 16
"""Largest number of gauges in a row."""

Change = Callable[[Finger, float], Finger]


def _shaped(finger: Finger, values: Mapping[str, float]) -> Finger:
    """All lengths of the shape set at once: one after the other, layers might cross on the way.

    The whole body first (gauges stay as large as they are, and keep their angles), then the outer surface, the skin
    (equally thick at all ends of the axes), and the other surfaces.
    """
    shape: Any = finger.shape
    factor, skin = values.get("shape.scale", 1.0), values.get("shape.skin_mm")
    axes = {name: [factor * length for length in getattr(shape, name)] for name in FINGER_SURFACES}
    for name in FINGER_SURFACES:
        if name == "interface" and skin is not None:
            axes[name] = [length - skin for length in axes["outer"]]
        letters = _axes_of(finger)
        axes[name] = [values.get(f"shape.{name}.{x}_mm", length) for x, length in zip(letters, axes[name], strict=True)]
    lengths: dict[str, Any] = {name: tuple(lengths_of_axes) for name, lengths_of_axes in axes.items()}
    if isinstance(shape, Slab):
        lengths["depth"] = values.get("shape.depth_mm", factor * shape.depth)
    gauges = tuple(replace(length, y_mm=factor * length.y_mm) for length in finger.gauges)
    ridges = finger.ridges and replace(
        finger.ridges, **{key: factor * value for key, value in vars(finger.ridges).items()}
    )
    shape = replace(shape, **lengths)
    patch = finger.patch_radius and factor * finger.patch_radius
    return replace(finger, shape=shape, patch_radius=patch, gauges=gauges, ridges=ridges)


def _axes_of(finger: Finger) -> str:
    """Letters of the semi-axes of a finger's shape; raises `InputError` for surface files."""
    if not isinstance(finger.shape, Dome | Slab):
        raise InputError("a study varies a dome or a slab: its finger is of surface files")
    return "xyz" if isinstance(finger.shape, Dome) else "xz"


def _layer(name: str, key: str, finger: Finger, value: float) -> Finger:
    layer: Layer = getattr(finger, name)
    return replace(finger, **{name: replace(layer, **{key: value}, material=None)})  # type: ignore[arg-type]


def _row(finger: Finger, count: float) -> Finger:
    """A row of `count` gauges at y = 0, with the outermost gauge at its old place."""
    number = round(count)
    if number != count or not 1 <= number <= MOST_ROW_GAUGES:
        raise InputError(f"gauges.count must be a whole number from 1 to {MOST_ROW_GAUGES}, got {count:g}")
    spread = max(abs(gauge.angle_deg or 0.0) for gauge in finger.gauges)
    first = replace(finger.gauges[0], x_mm=None, y_mm=0.0, direction_deg=0.0)
    return replace(finger, gauges=tuple(_placed(first, k, number, spread) for k in range(number)))


def _spread(finger: Finger, spread: float) -> Finger:
    count = len(finger.gauges)
    return replace(finger, gauges=tuple(_placed(gauge, k, count, spread) for k, gauge in enumerate(finger.gauges)))


def _placed(gauge: Gauge, k: int, count: int, spread: float) -> Gauge:
    angle = 0.0 if count == 1 else spread * (2 * k / (count - 1) - 1)
    return replace(gauge, name=f"g{k + 1}", angle_deg=angle, x_mm=None)


def _gauges(name: str | None, key: str, finger: Finger, value: float) -> Finger:
    """A value of one gauge, or of all gauges."""
    changed: dict[str, Any] = {key: value} | ({"x_mm": None} if key == "angle_deg" else {})
    gauges = [replace(gauge, **changed) if name in (None, gauge.name) else gauge for gauge in finger.gauges]
    return replace(finger, gauges=tuple(gauges))


def parameters_of(finger: Finger, more: Iterable[str] = ()) -> dict[str, Change | None]:
    """What may be varied of a finger, in the order in which it is applied: name -> change; those of the shape, which
    are applied together, have none.

    more : names that a study uses; those of gauges of a longer row count as known.
    """
    of_shape = ["scale", "skin_mm", *(f"{name}.{x}_mm" for name in FINGER_SURFACES for x in _axes_of(finger))]
    if isinstance(finger.shape, Slab):
        of_shape.append("depth_mm")
    changes: dict[str, Change | None] = {f"shape.{name}": None for name in of_shape}
    for layer in ("outer", "inner"):
        changes |= {
            f"{layer}.nu": partial(_layer, layer, "nu"),
            f"{layer}.modulus_MPa": partial(_layer, layer, "modulus"),
        }
    changes |= {"gauges.count": _row, "gauges.spread_deg": _spread}
    changes |= {f"gauges.{key}": partial(_gauges, None, key) for key in ("membrane_gain", "lever_mm")}
    names = [gauge.name for gauge in finger.gauges]
    names += [f"g{k + 1}" for k in range(MOST_ROW_GAUGES) if "gauges.count" in more and f"g{k + 1}" not in names]
    changes |= {f"gauges.{name}.{key}": partial(_gauges, name, key) for name in names for key in OF_GAUGE}
    return changes


def of_geometry(name: str) -> bool:
    """Whether a parameter needs another mesh and new reductions."""
    return name.startswith("shape.") or name.endswith(".nu")


def made(base: Finger, values: Mapping[str, float]) -> Finger:
    """The finger with these values of parameters; raises `InputError` if it is impossible (layers that cross)."""
    finger = _shaped(base, values)
    for name, change in parameters_of(base, values).items():
        if name in values and change is not None:
            try:
                finger = change(finger, float(values[name]))
            except InputError as error:
                raise InputError(f"{name} = {values[name]:g}: {error}") from error
    return replace(finger, identified=None)


def refuse_unknown(name: str, allowed: Iterable[str], where: str) -> None:
    """Raise `InputError` for a name that is not known, with the nearest one."""
    allowed = list(allowed)
    if name not in allowed:
        near = difflib.get_close_matches(name, allowed, n=1, cutoff=0.4) if len(name) <= MOST_PRINTED_LETTERS else ()
        raise InputError(f"{where}: unknown {short(name)!r}" + (f", did you mean {near[0]!r}?" if near else ""))
