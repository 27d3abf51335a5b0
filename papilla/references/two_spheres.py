"""Two spheres in contact: how they share the approach, and how large the contact is (2006, equations (6)-(8))."""

import math
from dataclasses import dataclass

from papilla import checks


@dataclass(frozen=True)
class SharedApproach:
    """The approach of two bodies in mm, by the first and by the second, and their contact area (mm2)."""

    first: float
    second: float
    area: float


def shared_approach(
    force: float, radius: float, E_first: float, E_second: float, nu_first: float = 0.5, nu_second: float = 0.5
) -> SharedApproach:
    """Two spheres of `radius` mm each under `force` N: Hertz's approach, shared as the bodies' compliances are.

    w_o / w_f = [(1 - nu_o^2) / E_o] / [(1 - nu_f^2) / E_f], which is equation (7) of 2006 for equal nu, and
    A = pi (R / 2) (w_f + w_o): equation (6) prints pi R (w_f + w_o), that of one sphere on a flat, twice too large
    for two equal spheres. Moduli in MPa. Raises `InputError` for what is not positive, or nu outside [0, 0.5].
    Source: Johnson (1985), section 4.2, doi:10.1017/CBO9781139171731; 2006 paper, equations (6) and (7).
    """
    from papilla.references.hertz import effective_modulus, hertz_sphere

    composite = checks.positive("radius (mm)", radius) / 2
    contact = hertz_sphere(force, composite, effective_modulus(E_first, nu_first, E_second, nu_second))
    first = 1 / effective_modulus(E_first, nu_first)
    share = first * effective_modulus(E_first, nu_first, E_second, nu_second)
    return SharedApproach(share * contact.indentation, (1 - share) * contact.indentation, contact.area)


def printed_area(w_f: float, w_o: float, radius: float) -> float:
    """Contact area (mm2) by equation (6) of 2006 as printed: pi R (w_f + w_o), all in mm.

    Raises `InputError` for a radius that is not positive. Source: 2006 paper, section IV.A (its hertzian half:
    Johnson (1985), section 4.2, doi:10.1017/CBO9781139171731).
    """
    return math.pi * checks.positive("radius (mm)", radius) * (w_f + w_o)


def printed_area_per_approach(E_f: float, E_o: float, radius: float) -> float:
    """A / w_f (mm) by equation (8) of 2006 as printed: pi R (1 + E_f / E_o), moduli in MPa, R in mm.

    It has no force in it, and towards hard objects it goes to pi R: what a harder object changes gets ever smaller.
    Raises `InputError` for what is not positive. Source: 2006 paper, section IV.A (its hertzian half: Johnson (1985),
    section 4.2, doi:10.1017/CBO9781139171731).
    """
    ratio = checks.positive("E_f (MPa)", E_f) / checks.positive("E_o (MPa)", E_o)
    return math.pi * checks.positive("radius (mm)", radius) * (1 + ratio)
