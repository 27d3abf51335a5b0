"""The `hertz` rung: a press is a look-up in the tables of the ellipses of least energy."""

from dataclasses import dataclass

import numpy as np

from papilla.errors import ContactRangeError
from papilla.fem.pressing.hertz_table import hertz_table
from papilla.fem.pressing.press import Press, press_result
from papilla.fem.pressing.profile import layer_factor, peak_over_mean
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.specimen import Specimen


@dataclass(frozen=True)
class HertzScene:
    """Semi-axes (mm), layer term q, peak pressure (MPa), indentation (mm) and gauge quantities (g,) of one press."""

    force: float
    semi_axes: tuple[float, float]
    layer_term: float
    peak_pressure: float
    indentation: float
    strain: np.ndarray
    curvature: np.ndarray


def hertz_scene(
    reduced: ReducedFinger, specimen: Specimen, force: float | None, indentation: float | None
) -> HertzScene:
    """One press by force (N) or indentation (mm); raises `ContactRangeError` where the ellipse leaves the patch."""
    table = hertz_table(reduced, specimen)
    if indentation is not None:
        _refuse_beyond(indentation, table.indentation[-1], "an indentation", "mm")
        # Interpolated as below, in force^(2/3), where Hertz's law is a straight line
        force = float(np.interp(indentation, table.indentation, table.cube_root**2) ** 1.5)
    assert force is not None
    _refuse_beyond(force, table.force[-1] * (1 + 1e-12), "a force", "N")
    a, b, q, per_newton = table.at(force)
    gauges = len(reduced.gauge_names)
    return HertzScene(
        force=force,
        semi_axes=(a, b),
        layer_term=q,
        peak_pressure=peak_over_mean(q) * force / (np.pi * a * b),
        indentation=float(np.interp(np.cbrt(force) ** 2, table.cube_root**2, table.indentation)),
        strain=force * per_newton[:gauges],
        curvature=force * per_newton[gauges:],
    )


def hertz_press(
    reduced: ReducedFinger,
    specimen: Specimen,
    force: float | None,
    indentation: float | None,
    status: str,
    began: float,
) -> Press:
    """One press by force (N) or indentation (mm) as a `Press` that says `status`; raises `ContactRangeError`."""
    scene = hertz_scene(reduced, specimen, force, indentation)
    a, b = scene.semi_axes
    patch = reduced.patch
    x, y = patch.xy.T
    shape = layer_factor(np.sqrt(np.maximum(0.0, 1 - (x / a) ** 2 - (y / b) ** 2)), scene.layer_term)
    # An ellipse between the nodes goes to the nearest one; whatever they sample of it, they carry the force
    shape[np.argmin(np.hypot(x, y))] += float(not shape.any())
    pressure = scene.force / (reduced.multiplicity * patch.mass @ shape) * shape
    return press_result(
        reduced,
        specimen,
        began,
        force=scene.force,
        fidelity="hertz",
        indentation=scene.indentation,
        contact_area=float(np.pi * a * b),
        peak_pressure=scene.peak_pressure,
        strain=scene.strain,
        curvature=scene.curvature,
        force_balance=abs(float(reduced.multiplicity * patch.mass @ pressure) - scene.force) / scene.force,
        status=status,
        resolved=True,
        pressure=pressure,
        active=shape > 0,
    )


def _refuse_beyond(value, limit: float, what: str, unit: str) -> None:
    if value > limit:
        raise ContactRangeError(
            f"{what} of {value:g} {unit} takes the contact to the rim of its patch ({limit:.3g} {unit})"
        )
