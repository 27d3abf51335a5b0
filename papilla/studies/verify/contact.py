"""Contact against its exact answers: Hertz, bonded layers, a coat; friction, adhesion and creep of a sphere.

A ball of 100 mm and an elliptic gap press a block of 600 contact radii; layers are incompressible and bonded to a rigid
table. Exact are Hertz, Boussinesq's point force under Hertz's pressure, the dual integral equation of a bonded layer,
Mossakovskii (stick) and Spence (slip), Johnson, Kendall and Roberts (adhesion), Lee and Radok (a skin that relaxes).
"""

from collections.abc import Iterator

import numpy as np

from papilla import references
from papilla.fem import ReducedFinger, press
from papilla.fem.pressing.adhesion import adhesive_press
from papilla.fem.pressing.contact_path import ContactProblem
from papilla.fem.pressing.creep import creeping_press
from papilla.fem.pressing.loading_path import LoadingPath
from papilla.fem.reduction.compliance import PatchSurface, quadrature, weak_gap
from papilla.finger import Layer
from papilla.references import Prony, StackLayer
from papilla.specimen import Block, Friction, HalfSpace, friction_coefficient
from papilla.studies.case import Case
from papilla.studies.verify import bodies
from papilla.studies.verify.bodies import BALL, BALL_RADIUS, DEEP, bonded_layer, compared, half_space, off
from papilla.studies.verify.flat import with_gap
from papilla.studies.verify.spectral import stack_sphere

MODULUS, NU, RIGID = 1.0, 0.3, 1e9
E_STAR = MODULUS / (1 - NU**2)

FORCE_BOUND, AREA_BOUND, SHEAR_BOUND = 0.01, 0.02, 0.03
ADHESION_BOUND, CREEP_BOUND = 0.03, 0.01

CHIS = (0.19, 0.49, 0.75, 1.05)
"""Contact radius over thickness of the layers."""

THICKNESS = 1.5
"""Thickness (mm) of the layer that is pressed with friction."""

PULLS = (0.1, 1.0)
"""Ratio of the ball's pull-off force to the pressing force."""

SERIES = Prony((0.2, 0.25), (0.5, 5.0))
TIME = np.concatenate([np.linspace(0.02, 1, 50), np.linspace(1.1, 10, 90)])
"""A ramp of 1 s, and a hold of 9 s."""

DEEPEST = 1.0 / BALL_RADIUS
"""Indentation (mm) of a contact of radius 1 mm; the crept one is less."""


def hertz() -> Iterator[Case]:
    """Sphere and ellipse on a block of 600 contact radii, at both fidelities, with gauges below."""
    depth, sites = 1.0, (0.0, 1.0, 2.5)
    reduced = half_space(Layer(MODULUS, NU), bodies.CHORDS_FOR_ELLIPSES, sites, depth).reduce()
    exact = references.hertz_sphere_at(1 / BALL_RADIUS, BALL_RADIUS, E_STAR)
    bounds = {"force": FORCE_BOUND, "radius": FORCE_BOUND, "peak_pressure": FORCE_BOUND}
    for fidelity in ("hertz", "contact"):
        pressed = press(reduced, BALL, indentation=exact.indentation, fidelity=fidelity)
        against = "at given indentation, against Hertz (closed form)"
        yield from compared(f"sphere on half-space, fidelity {fidelity}", against, pressed, exact, **bounds)
    expected = _boussinesq_strain(reduced, pressed.pressure, sites, depth)
    worst = float(np.abs(pressed.strain - expected).max() / np.abs(expected).max())
    measure = "elongation of 3 gauges over the largest, against Boussinesq under the same pressure (closed form)"
    yield Case("sphere on half-space, gauge strain", measure, worst, FORCE_BOUND)
    radii = (BALL_RADIUS, BALL_RADIUS / 2.5)
    bowl = with_gap(reduced, *radii)
    ellipse = references.hertz_ellipse(1.3 * exact.force, *radii, E_STAR)
    bounds = {"indentation": FORCE_BOUND, "area": AREA_BOUND, "peak_pressure": FORCE_BOUND}
    for fidelity in ("hertz", "contact"):
        pressed = press(bowl, HalfSpace(RIGID), force=ellipse.force, fidelity=fidelity)
        against = "at given force, against Hertz (closed form)"
        yield from compared(f"ellipse of radii 5:2, fidelity {fidelity}", against, pressed, ellipse, **bounds)


def layers() -> Iterator[Case]:
    """Sphere on a bonded incompressible layer at four ratios of contact to thickness."""
    for chi in CHIS:
        thickness, indentation = bodies.at_unit_contact(chi, MODULUS)
        exact = references.bonded_layer_sphere(indentation, BALL_RADIUS, thickness, MODULUS, 0.5)
        reduced = bonded_layer(Layer(MODULUS, 0.5), thickness).reduce()
        found = press(reduced, BALL, indentation=indentation, fidelity="contact")
        against = "at given indentation, against the dual integral equation (exact solution)"
        bounds = {"force": FORCE_BOUND, "area": AREA_BOUND, "peak_pressure": AREA_BOUND}
        yield from compared(f"sphere on incompressible layer, chi {chi:g}", against, found, exact, **bounds)


def coat() -> Iterator[Case]:
    """Sphere on a half-space with a harder coat as thick as the contact is wide."""
    contrast, nu = 10.0, 0.4999
    exact = stack_sphere(1.0, BALL_RADIUS, [StackLayer(1.0, MODULUS, nu)], HalfSpace(MODULUS / contrast, nu))
    body = bodies.coated(Layer(MODULUS, nu), Layer(MODULUS / contrast, nu), 1.0, depth=1.5 * DEEP, width=1.5 * DEEP)
    found = press(body.reduce(), BALL, indentation=exact.indentation, fidelity="contact")
    name = f"sphere on half-space with a {contrast:g} times harder coat"
    against = "at given indentation, against integral transforms (second method)"
    bounds = {"force": FORCE_BOUND, "area": AREA_BOUND, "peak_pressure": AREA_BOUND}
    yield from compared(name, against, found, exact, **bounds)


def friction() -> Iterator[Case]:
    """A ball on a block of 600 contact radii, and on a bonded layer that is meshed or taken from its kernels."""
    model = half_space(Layer(MODULUS, NU))
    reduced = model.reduce()
    beta = references.dundurs_beta(MODULUS, NU)
    frictions: tuple[tuple[Friction, str], ...] = (("stick", "Mossakovskii"), (0.2, "Spence"), (0.1, "Spence"))
    for value, source in frictions:
        exact = references.frictional_punch(beta, friction_coefficient(value))
        force, indentation = exact.sphere(1.0, BALL_RADIUS, E_STAR)
        found = press(reduced, BALL, indentation=indentation, friction=value)
        name, against = f"sphere on half-space, friction {value}", f"at given indentation, against {source}"
        yield Case(f"{name}, force", f"force {against} (exact solution)", off(found.force, force), FORCE_BOUND)
        moment = shear_moment(reduced, found.traction)
        measure = f"moment of the shear {against} (exact solution)"
        yield Case(f"{name}, shear", measure, off(moment, exact.shear_moment * force), SHEAR_BOUND)
    yield from _layer_both_ways()


def _layer_both_ways() -> Iterator[Case]:
    """An incompressible layer under a ball, by finite elements and by its kernels."""
    layer = Layer(MODULUS, 0.5)
    model = bonded_layer(layer, THICKNESS)
    reduced = model.reduce()
    patch, n = reduced.patch, len(reduced.patch.xy)
    turned = np.repeat([1.0, -1.0, -1.0], n)
    kernels = Block(MODULUS, THICKNESS, 0.5).traction_compliance(PatchSurface(patch, reduced.half_space))
    problem = ContactProblem(turned[:, None] * kernels * turned, patch.mass, weak_gap(patch, BALL), (patch.xy == 0).T)
    for value in ("stick", 0.1):
        found = press(reduced, BALL, indentation=0.6 / BALL_RADIUS, friction=value)
        expected = LoadingPath(problem, friction_coefficient(value)).at(indentation=0.6 / BALL_RADIUS)
        assert expected is not None
        name = f"sphere on incompressible layer, friction {value}"
        against = "at given indentation, against the layer's kernels (second method)"
        force = reduced.multiplicity * expected.force
        yield Case(f"{name}, force", f"force {against}", off(found.force, force), FORCE_BOUND)
        moments = shear_moment(reduced, found.traction), shear_moment(reduced, expected.traction)
        yield Case(f"{name}, shear", f"moment of the shear {against}", off(*moments), SHEAR_BOUND)


def shear_moment(reduced: ReducedFinger, traction: np.ndarray) -> float:
    """int q . x dA (N mm) of tangential tractions (3, n) on the whole patch."""
    points, weights, hats = quadrature(reduced.patch)
    return reduced.multiplicity * float(weights @ ((hats @ traction[1:].T) * points).sum(axis=1))


def adhesion() -> Iterator[Case]:
    """A ball on a block of 600 contact radii, weakly and strongly adhesive."""
    reduced = half_space(Layer(MODULUS, NU)).reduce()
    force = 4 / 3 * E_STAR * 0.5**3 / BALL_RADIUS
    for pull in PULLS:
        work = pull * force / (1.5 * np.pi * BALL_RADIUS)
        energy = 3 * np.pi * work * BALL_RADIUS
        held = force + energy + np.sqrt(2 * energy * force + energy**2)
        radius = (3 * held * BALL_RADIUS / (4 * E_STAR)) ** (1 / 3)
        depth = radius**2 / BALL_RADIUS - np.sqrt(2 * np.pi * work * radius / E_STAR)
        found = adhesive_press(reduced, BALL, 1e3 * work, force_N=force)
        name, against = f"ball with a pull-off force of {pull:g} of the load", "against JKR (exact solution)"
        plain = press(reduced, BALL, force=force, fidelity="contact")
        area = found.contact_area / plain.contact_area, (held / force) ** (2 / 3)
        yield Case(f"{name}, area", f"contact area over Hertz's {against}", off(*area), ADHESION_BOUND)
        hertz = (3 * force * BALL_RADIUS / (4 * E_STAR)) ** (2 / 3) / BALL_RADIUS
        lift = found.indentation / plain.indentation, depth / hertz
        yield Case(f"{name}, depth", f"indentation over Hertz's {against}", off(*lift), ADHESION_BOUND)


def creep() -> Iterator[Case]:
    """A ball on a block of 600 contact radii, pushed in and held, and loaded and held."""
    reduced = half_space(Layer(MODULUS, NU), bodies.FEW_CHORDS).reduce()
    ramp = np.minimum(TIME, 1.0)
    late = TIME > 0.5
    depth = DEEPEST * ramp
    found, elastic = (creeping_press(reduced, BALL, one, TIME, indentation=depth) for one in (SERIES, Prony((), ())))
    exact = references.lee_radok_force(TIME, depth, BALL_RADIUS, E_STAR, SERIES)
    hertz = 4 / 3 * E_STAR * np.sqrt(BALL_RADIUS) * depth**1.5
    ratio = (found.force / elastic.force) / (exact / hertz)
    yield Case(
        "held depth",
        "force over the elastic one against Lee and Radok (exact solution)",
        float(np.abs(ratio[late] - 1).max()),
        CREEP_BOUND,
    )
    force = 0.4 * hertz[-1] * ramp
    held = creeping_press(reduced, BALL, SERIES, TIME, force=force)
    crept = references.lee_radok_indentation(TIME, force, BALL_RADIUS, E_STAR, SERIES)
    measure = "indentation after the hold against Lee and Radok (exact solution)"
    yield Case("held force", measure, off(float(held.indentation[-1]), float(crept[-1])), CREEP_BOUND)


def _boussinesq_strain(reduced: ReducedFinger, pressure: np.ndarray, sites, depth: float) -> np.ndarray:
    """Elongation (g,) along x between two points 0.5 mm apart at a depth, the pressure taken as point forces."""
    places, forces = bodies.surface_pressure(reduced, pressure)
    strains = []
    for site in sites:
        ends = []
        for x in (site - 0.25, site + 0.25):
            points = np.column_stack([x - places[:, 0], -places[:, 1], np.full(len(places), depth)])
            ends.append(forces @ references.boussinesq_displacement(points, 1.0, MODULUS, NU)[:, 0])
        strains.append((ends[1] - ends[0]) / 0.5)
    return np.array(strains)
