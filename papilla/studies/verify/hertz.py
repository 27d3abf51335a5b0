"""Contact against its exact answers: sphere and ellipse on a half-space, sphere on bonded layers and on a coat."""

from collections.abc import Iterator

import numpy as np

from papilla.fem import ReducedFinger, press
from papilla.finger import Layer
from papilla.references import (
    StackLayer,
    bonded_layer_sphere,
    boussinesq_displacement,
    hertz_ellipse,
    hertz_sphere_at,
)
from papilla.specimen import HalfSpace
from papilla.studies.case import Case
from papilla.studies.verify.bodies import (
    BALL,
    BALL_RADIUS,
    CHORDS_FOR_ELLIPSES,
    DEEP,
    at_unit_contact,
    bonded_layer,
    coated,
    compared,
    half_space,
    surface_pressure,
)
from papilla.studies.verify.flat import with_gap
from papilla.studies.verify.spectral import stack_sphere

MODULUS, RIGID = 1.0, 1e9

FORCE_BOUND, AREA_BOUND = 0.01, 0.02

CHIS = (0.19, 0.49, 0.75, 1.05)


def hertz() -> Iterator[Case]:
    """Sphere and ellipse on a block of 600 contact radii, at both fidelities, with gauges below."""
    nu, depth, sites = 0.3, 1.0, (0.0, 1.0, 2.5)
    reduced = half_space(Layer(MODULUS, nu), CHORDS_FOR_ELLIPSES, sites, depth).reduce()
    e_star = MODULUS / (1 - nu**2)
    exact = hertz_sphere_at(1 / BALL_RADIUS, BALL_RADIUS, e_star)
    bounds = {"force": FORCE_BOUND, "radius": FORCE_BOUND, "peak_pressure": FORCE_BOUND}
    for fidelity in ("hertz", "contact"):
        pressed = press(reduced, BALL, indentation=exact.indentation, fidelity=fidelity)
        against = "at given indentation, against Hertz (closed form)"
        yield from compared(f"sphere on half-space, fidelity {fidelity}", against, pressed, exact, **bounds)
    expected = _boussinesq_strain(reduced, pressed.pressure, nu, sites, depth)
    worst = float(np.abs(pressed.strain - expected).max() / np.abs(expected).max())
    measure = "elongation of 3 gauges over the largest, against Boussinesq under the same pressure (closed form)"
    yield Case("sphere on half-space, gauge strain", measure, worst, FORCE_BOUND)
    radii = (BALL_RADIUS, BALL_RADIUS / 2.5)
    bowl = with_gap(reduced, *radii)
    ellipse = hertz_ellipse(1.3 * exact.force, *radii, e_star)
    bounds = {"indentation": FORCE_BOUND, "area": AREA_BOUND, "peak_pressure": FORCE_BOUND}
    for fidelity in ("hertz", "contact"):
        pressed = press(bowl, HalfSpace(RIGID), force=ellipse.force, fidelity=fidelity)
        against = "at given force, against Hertz (closed form)"
        yield from compared(f"ellipse of radii 5:2, fidelity {fidelity}", against, pressed, ellipse, **bounds)


def layers() -> Iterator[Case]:
    """Sphere on a bonded incompressible layer at four ratios of contact to thickness."""
    for chi in CHIS:
        thickness, indentation = at_unit_contact(chi, MODULUS)
        exact = bonded_layer_sphere(indentation, BALL_RADIUS, thickness, MODULUS, 0.5)
        reduced = bonded_layer(Layer(MODULUS, 0.5), thickness).reduce()
        found = press(reduced, BALL, indentation=indentation, fidelity="contact")
        against = "at given indentation, against the dual integral equation (exact solution)"
        bounds = {"force": FORCE_BOUND, "area": AREA_BOUND, "peak_pressure": AREA_BOUND}
        yield from compared(f"sphere on incompressible layer, chi {chi:g}", against, found, exact, **bounds)


def coat() -> Iterator[Case]:
    """Sphere on a half-space with a harder coat as thick as the contact is wide."""
    contrast, nu = 10.0, 0.4999
    exact = stack_sphere(1.0, BALL_RADIUS, [StackLayer(1.0, MODULUS, nu)], HalfSpace(MODULUS / contrast, nu))
    body = coated(Layer(MODULUS, nu), Layer(MODULUS / contrast, nu), 1.0, depth=1.5 * DEEP, width=1.5 * DEEP)
    found = press(body.reduce(), BALL, indentation=exact.indentation, fidelity="contact")
    name = f"sphere on half-space with a {contrast:g} times harder coat"
    against = "at given indentation, against integral transforms (second method)"
    bounds = {"force": FORCE_BOUND, "area": AREA_BOUND, "peak_pressure": AREA_BOUND}
    yield from compared(name, against, found, exact, **bounds)


def _boussinesq_strain(reduced: ReducedFinger, pressure: np.ndarray, nu: float, sites, depth: float) -> np.ndarray:
    """Elongation (g,) along x between two points 0.5 mm apart at a depth, the pressure taken as point forces."""
    places, forces = surface_pressure(reduced, pressure)
    strains = []
    for site in sites:
        ends = []
        for x in (site - 0.25, site + 0.25):
            points = np.column_stack([x - places[:, 0], -places[:, 1], np.full(len(places), depth)])
            ends.append(forces @ boussinesq_displacement(points, 1.0, MODULUS, nu)[:, 0])
        strains.append((ends[1] - ends[0]) / 0.5)
    return np.array(strains)
