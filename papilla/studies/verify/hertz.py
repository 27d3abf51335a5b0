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
from papilla.specimen import HalfSpace, Sphere
from papilla.studies.verify.bodies import (
    BALL_RADIUS,
    DEEP,
    bonded_layer,
    coated,
    contact_radius,
    half_space,
    off,
    surface_pressure,
)
from papilla.studies.verify.case import Check
from papilla.studies.verify.flat import with_gap
from papilla.studies.verify.spectral import stack_sphere

MODULUS, RIGID = 1.0, 1e9

FORCE_BOUND, AREA_BOUND = 0.01, 0.02

CHIS = (0.19, 0.49, 0.75, 1.05)

BALL = Sphere(RIGID, BALL_RADIUS)


def hertz() -> Iterator[Check]:
    """Sphere and ellipse on a block of 600 contact radii, on both rungs, with gauges below."""
    nu, depth, sites = 0.3, 1.0, (0.0, 1.0, 2.5)
    reduced = half_space(Layer(MODULUS, nu), sites, depth).reduce()
    e_star = MODULUS / (1 - nu**2)
    exact = hertz_sphere_at(1 / BALL_RADIUS, BALL_RADIUS, e_star)
    for rung in ("contact", "hertz"):
        found = press(reduced, BALL, indentation=exact.indentation, fidelity=rung)
        name, against = f"sphere on half-space, rung {rung}", "at given indentation, against Hertz (closed form)"
        radius = off(contact_radius(found.contact_area), exact.a)
        yield Check(f"{name}, force", f"force {against}", off(found.force, exact.force), FORCE_BOUND)
        yield Check(f"{name}, radius", f"contact radius {against}", radius, FORCE_BOUND)
        pressure = off(found.peak_pressure, exact.peak_pressure)
        yield Check(f"{name}, peak pressure", f"peak pressure {against}", pressure, FORCE_BOUND)
    pressed = press(reduced, BALL, indentation=exact.indentation, fidelity="contact")
    expected = _boussinesq_strain(reduced, pressed.pressure, nu, sites, depth)
    worst = float(np.abs(pressed.strain - expected).max() / np.abs(expected).max())
    measure = "elongation of 3 gauges over the largest, against Boussinesq under the same pressure (closed form)"
    yield Check("sphere on half-space, gauge strain", measure, worst, FORCE_BOUND)
    radii = (BALL_RADIUS, BALL_RADIUS / 2.5)
    bowl = with_gap(reduced, *radii)
    ellipse = hertz_ellipse(1.3 * exact.force, *radii, e_star)
    for rung in ("contact", "hertz"):
        found = press(bowl, HalfSpace(RIGID), force=ellipse.force, fidelity=rung)
        name, against = f"ellipse of radii 5:2, rung {rung}", "at given force, against Hertz (closed form)"
        yield Check(
            f"{name}, indentation", f"indentation {against}", off(found.indentation, ellipse.indentation), FORCE_BOUND
        )
        yield Check(f"{name}, area", f"contact area {against}", off(found.contact_area, ellipse.area), AREA_BOUND)
        pressure = off(found.peak_pressure, ellipse.peak_pressure)
        yield Check(f"{name}, peak pressure", f"peak pressure {against}", pressure, FORCE_BOUND)


def layers() -> Iterator[Check]:
    """Sphere on a bonded incompressible layer at four ratios of contact to thickness."""
    for chi in CHIS:
        # Scaled so that the contact has the radius 1 that the mesh is made for
        unit = bonded_layer_sphere(1 / BALL_RADIUS, BALL_RADIUS, 1 / chi, MODULUS, 0.5)
        thickness, indentation = 1 / (chi * unit.contact_radius), 1 / (BALL_RADIUS * unit.contact_radius**2)
        exact = bonded_layer_sphere(indentation, BALL_RADIUS, thickness, MODULUS, 0.5)
        reduced = bonded_layer(Layer(MODULUS, 0.5), thickness).reduce()
        found = press(reduced, BALL, indentation=indentation, fidelity="contact")
        against = "at given indentation, against the dual integral equation (exact solution)"
        name = f"sphere on incompressible layer, chi {chi:g}"
        yield Check(f"{name}, force", f"force {against}", off(found.force, exact.force), FORCE_BOUND)
        yield Check(f"{name}, area", f"contact area {against}", off(found.contact_area, exact.area), AREA_BOUND)
        pressure = off(found.peak_pressure, exact.peak_pressure)
        yield Check(f"{name}, peak pressure", f"peak pressure {against}", pressure, AREA_BOUND)


def coat() -> Iterator[Check]:
    """Sphere on a half-space with a harder coat as thick as the contact is wide."""
    contrast, nu = 10.0, 0.4999
    exact = stack_sphere(1.0, BALL_RADIUS, [StackLayer(1.0, MODULUS, nu)], HalfSpace(MODULUS / contrast, nu))
    body = coated(Layer(MODULUS, nu), Layer(MODULUS / contrast, nu), 1.0, depth=1.5 * DEEP, width=1.5 * DEEP)
    found = press(body.reduce(), BALL, indentation=exact.indentation, fidelity="contact")
    against = "at given indentation, against integral transforms (second method)"
    name = f"sphere on half-space with a {contrast:g} times harder coat"
    yield Check(f"{name}, force", f"force {against}", off(found.force, exact.force), FORCE_BOUND)
    radius = contact_radius(found.contact_area)
    yield Check(f"{name}, area", f"contact area {against}", off(radius**2, exact.contact_radius**2), AREA_BOUND)
    pressure = off(found.peak_pressure, exact.peak_pressure)
    yield Check(f"{name}, peak pressure", f"peak pressure {against}", pressure, AREA_BOUND)


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
