"""Contact against its exact answers: Hertz, bonded layers, a coat, and friction of a sphere.

A ball of 100 mm and an elliptic gap press a block of 600 contact radii; layers are incompressible and bonded to a rigid
table. Exact are Hertz, Boussinesq's point force under Hertz's pressure, the dual integral equation of a bonded layer,
Mossakovskii (stick) and Spence (slip).
"""

from collections.abc import Iterator

import numpy as np

from papilla import references
from papilla.core import settings
from papilla.fem import ReducedFinger, press
from papilla.fem.pressing.contact import LoadingPath
from papilla.fem.pressing.contact_path import ContactProblem
from papilla.fem.reduction.compliance import PatchSurface
from papilla.fem.reduction.patch import quadrature, weak_gap
from papilla.model.finger import Layer
from papilla.model.specimen import Block, HalfSpace, friction_coefficient
from papilla.references import StackLayer
from papilla.verify import bodies
from papilla.verify.bodies import BALL_RADIUS, BALL_SPECIMEN, DEEP_MM, bonded_layer, compared, half_space, off
from papilla.verify.case import Case

CONTACT_CASES = settings.parameters(__name__)
BODY_MODULUS_MPA, SPECIMEN_NU = CONTACT_CASES.modulus_MPa, CONTACT_CASES.nu
E_STAR = BODY_MODULUS_MPA / (1 - SPECIMEN_NU**2)
LAYER_BOUNDS = {"force": CONTACT_CASES.force_bound} | dict.fromkeys(("area", "peak_pressure"), CONTACT_CASES.area_bound)


def hertz() -> Iterator[Case]:
    """Sphere and ellipse on a block of 600 contact radii, at both fidelities, with gauges below."""
    depth, sites = CONTACT_CASES.gauge_depth_mm, CONTACT_CASES.gauge_sites_mm
    gauges = {"sites": sites, "interface": depth, "length": 2 * CONTACT_CASES.gauge_half_mm}
    reduced = half_space(Layer(BODY_MODULUS_MPA, SPECIMEN_NU), bodies.CHORDS_FOR_ELLIPSES, **gauges).reduce()
    exact = references.hertz_sphere_at(1 / BALL_RADIUS, BALL_RADIUS, E_STAR)
    bounds = dict.fromkeys(("force", "radius", "peak_pressure"), CONTACT_CASES.force_bound)
    for fidelity in ("hertz", "contact"):
        pressed = press(reduced, BALL_SPECIMEN, indentation=exact.indentation, fidelity=fidelity)
        against = "at given indentation, against Hertz (closed form)"
        yield from compared(f"sphere on half-space, fidelity {fidelity}", against, pressed, exact, **bounds)
    expected = _boussinesq_strain(reduced, pressed.pressure, sites, depth)
    worst = bodies.apart(pressed.strain, expected)
    measure = "elongation of 3 gauges over the largest, against Boussinesq under the same pressure (closed form)"
    yield Case("sphere on half-space, gauge strain", measure, worst, CONTACT_CASES.force_bound)
    radii = (BALL_RADIUS, BALL_RADIUS / CONTACT_CASES.ellipse_ratio)
    bowl = bodies.with_gap(reduced, *radii)
    ellipse = references.hertz_ellipse(CONTACT_CASES.ellipse_force * exact.force, *radii, E_STAR)
    bounds = {
        "indentation": CONTACT_CASES.force_bound,
        "area": CONTACT_CASES.area_bound,
        "peak_pressure": CONTACT_CASES.force_bound,
    }
    for fidelity in ("hertz", "contact"):
        pressed = press(bowl, HalfSpace(CONTACT_CASES.rigid_MPa), force=ellipse.force, fidelity=fidelity)
        against = "at given force, against Hertz (closed form)"
        yield from compared(f"ellipse of radii 5:2, fidelity {fidelity}", against, pressed, ellipse, **bounds)


def layers() -> Iterator[Case]:
    """Sphere on a bonded incompressible layer at four ratios of contact to thickness."""
    for chi in CONTACT_CASES.chis:
        thickness, indentation = bodies.at_unit_contact(chi, BODY_MODULUS_MPA)
        exact = references.bonded_layer_sphere(indentation, BALL_RADIUS, thickness, BODY_MODULUS_MPA, 0.5)
        reduced = bonded_layer(Layer(BODY_MODULUS_MPA, 0.5), thickness).reduce()
        pressed = press(reduced, BALL_SPECIMEN, indentation=indentation, fidelity="contact")
        against = "at given indentation, against the dual integral equation (exact solution)"
        yield from compared(f"sphere on incompressible layer, chi {chi:g}", against, pressed, exact, **LAYER_BOUNDS)


def coat() -> Iterator[Case]:
    """Sphere on a half-space with a harder coat as thick as the contact is wide."""
    contrast, nu = CONTACT_CASES.coat_contrast, CONTACT_CASES.coat_nu
    exact = bodies.stack_sphere(
        1.0, BALL_RADIUS, [StackLayer(1.0, BODY_MODULUS_MPA, nu)], HalfSpace(BODY_MODULUS_MPA / contrast, nu)
    )
    deep = CONTACT_CASES.coat_depth * DEEP_MM
    body = bodies.coated(
        Layer(BODY_MODULUS_MPA, nu), Layer(BODY_MODULUS_MPA / contrast, nu), 1.0, depth=deep, width=deep
    )
    pressed = press(body.reduce(), BALL_SPECIMEN, indentation=exact.indentation, fidelity="contact")
    name = f"sphere on half-space with a {contrast:g} times harder coat"
    against = "at given indentation, against integral transforms (second method)"
    yield from compared(name, against, pressed, exact, **LAYER_BOUNDS)


def friction() -> Iterator[Case]:
    """A ball on a block of 600 contact radii, and on a bonded layer that is meshed or taken from its kernels."""
    reduced = half_space(Layer(BODY_MODULUS_MPA, SPECIMEN_NU)).reduce()
    beta = references.dundurs_beta(BODY_MODULUS_MPA, SPECIMEN_NU)
    for value, source in (("stick", "Mossakovskii"), *((mu, "Spence") for mu in CONTACT_CASES.slip_friction)):
        exact = references.frictional_punch(beta, friction_coefficient(value))
        force, indentation = exact.sphere(1.0, BALL_RADIUS, E_STAR)
        pressed = press(reduced, BALL_SPECIMEN, indentation=indentation, friction=value)
        name, against = f"sphere on half-space, friction {value}", f"at given indentation, against {source}"
        yield Case(
            f"{name}, force", f"force {against} (exact solution)", off(pressed.force, force), CONTACT_CASES.force_bound
        )
        moment = shear_moment(reduced, pressed.traction)
        measure = f"moment of the shear {against} (exact solution)"
        yield Case(f"{name}, shear", measure, off(moment, exact.shear_moment * force), CONTACT_CASES.shear_bound)
    yield from _layer_both_ways()


def _layer_both_ways() -> Iterator[Case]:
    """An incompressible layer under a ball, by finite elements and by its kernels."""
    thickness, depth = CONTACT_CASES.friction_thickness_mm, CONTACT_CASES.layer_indentation / BALL_RADIUS
    reduced = bonded_layer(Layer(BODY_MODULUS_MPA, 0.5), thickness).reduce()
    patch = reduced.patch
    turned = np.repeat([1.0, -1.0, -1.0], len(patch.xy))
    kernels = Block(BODY_MODULUS_MPA, thickness, 0.5).traction_compliance(PatchSurface(patch, reduced.half_space))
    problem = ContactProblem(
        turned[:, None] * kernels * turned, patch.mass, weak_gap(patch, BALL_SPECIMEN), (patch.xy == 0).T
    )
    for value in CONTACT_CASES.layer_friction:
        pressed = press(reduced, BALL_SPECIMEN, indentation=depth, friction=value)
        expected = LoadingPath(problem, friction_coefficient(value)).at(indentation=depth)
        assert expected is not None
        name = f"sphere on incompressible layer, friction {value}"
        against = "at given indentation, against the layer's kernels (second method)"
        force = reduced.multiplicity * expected.force
        yield Case(f"{name}, force", f"force {against}", off(pressed.force, force), CONTACT_CASES.force_bound)
        moments = shear_moment(reduced, pressed.traction), shear_moment(reduced, expected.traction)
        yield Case(f"{name}, shear", f"moment of the shear {against}", off(*moments), CONTACT_CASES.shear_bound)


def shear_moment(reduced: ReducedFinger, traction: np.ndarray) -> float:
    """int q . x dA (N mm) of tangential tractions (3, n) on the whole patch."""
    points, weights, hats = quadrature(reduced.patch)
    return reduced.multiplicity * float(weights @ ((hats @ traction[1:].T) * points).sum(axis=1))


def _boussinesq_strain(reduced: ReducedFinger, pressure: np.ndarray, sites, depth: float) -> np.ndarray:
    """Elongation (g,) along x between two points at a depth, the pressure taken as point forces."""
    half = CONTACT_CASES.gauge_half_mm
    places, forces = bodies.surface_pressure(reduced, pressure)
    strains = []
    for site in sites:
        ends = []
        for x in (site - half, site + half):
            points = np.column_stack([x - places[:, 0], -places[:, 1], np.full(len(places), depth)])
            ends.append(forces @ references.boussinesq_displacement(points, 1.0, BODY_MODULUS_MPA, SPECIMEN_NU)[:, 0])
        strains.append((ends[1] - ends[0]) / (2 * half))
    return np.array(strains)
