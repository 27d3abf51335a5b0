"""Two equal spheres in contact: the share of each in the approach, and the contact area (2006, equations (6)-(8))."""

import math
from dataclasses import dataclass

from papilla import checks


@dataclass(frozen=True)
class SharedApproach:
    """Parts of the approach (mm) by which the first and the second body deform, and their contact area (mm2)."""

    first: float
    second: float
    area: float


def shared_approach(
    force: float, radius: float, E_first: float, E_second: float, nu_first: float = 0.5, nu_second: float = 0.5
) -> SharedApproach:
    """Two spheres of `radius` (mm) each under `force` (N): Hertz's approach, shared in proportion to their compliances.

    w_o / w_f = [(1 - nu_o^2) / E_o] / [(1 - nu_f^2) / E_f] is equation (7) of 2006 for equal nu, and A = pi (R / 2)
    (w_f + w_o). Equation (6) prints pi R (w_f + w_o), which holds for a sphere on a flat and is twice too large for two
    equal spheres. Moduli in MPa. Raises `InputError` for values that are not positive, or nu outside [0, 0.5]. Source:
    Johnson (1985), section 4.2, doi:10.1017/CBO9781139171731; 2006 paper, equations (6) and (7).
    """
    from papilla.references.hertz import effective_modulus, hertz_sphere

    composite = checks.positive("radius (mm)", radius) / 2
    contact = hertz_sphere(force, composite, effective_modulus(E_first, nu_first, E_second, nu_second))
    first = 1 / effective_modulus(E_first, nu_first)
    share = first * effective_modulus(E_first, nu_first, E_second, nu_second)
    return SharedApproach(share * contact.indentation, (1 - share) * contact.indentation, contact.area)


def printed_area(w_f: float, w_o: float, radius: float) -> float:
    """Contact area (mm2) of equation (6) of 2006 as printed: pi R (w_f + w_o), lengths in mm.

    Raises `InputError` for a radius that is not positive. Source: 2006 paper, section IV.A (its hertzian half:
    Johnson (1985), section 4.2, doi:10.1017/CBO9781139171731).
    """
    return math.pi * checks.positive("radius (mm)", radius) * (w_f + w_o)


def printed_area_per_approach(E_f: float, E_o: float, radius: float) -> float:
    """A / w_f (mm) of equation (8) of 2006 as printed: pi R (1 + E_f / E_o), moduli in MPa, R in mm.

    It does not depend on the force, and for hard objects it tends to pi R, so it hardly distinguishes them.
    Raises `InputError` for values that are not positive.
    Source: 2006 paper, section IV.A (its hertzian half: Johnson (1985), section 4.2, doi:10.1017/CBO9781139171731).
    """
    ratio = checks.positive("E_f (MPa)", E_f) / checks.positive("E_o (MPa)", E_o)
    return math.pi * checks.positive("radius (mm)", radius) * (1 + ratio)
