"""Compliance of a specimen under pressure and tangential tractions of the patch: all three components, coupled.

Unknowns are [p, q_1, q_2], each nodal (n,), in MPa of the contact plane: p pushes finger and specimen apart, q acts on
the finger along the plane's two axes and is turned on the specimen. Conjugate to them are the closure (how far both
surfaces give way) and the slip of the finger along the specimen, so that compliances are symmetric and add up.
Mirror images carry a component of q along a mirrored axis with the sign turned.
"""

from functools import lru_cache

import numpy as np

from papilla.fem.reduction.compliance import edge_logarithm, symmetric, weak_terms
from papilla.fem.reduction.patch import Patch
from papilla.references.tangential import BondedLayerGreen
from papilla.specimen import Block, Specimen


def traction_compliance(patch: Patch, specimen: Specimen) -> np.ndarray:
    """Weak compliance (3n, 3n) of a specimen's surface, mm3 / MPa; symmetric, its first (n, n) block the normal one.

    A ball gives way as a half-space does; a bonded block by its exact layer tensor.
    """
    nu = specimen.nu
    plain, dyadic, coupling = half_space_parts(patch)
    parts = (1 - nu) * plain + nu * dyadic + (1 - 2 * nu) / 2 * coupling
    compliance = (1 + nu) / np.pi * parts
    if isinstance(specimen, Block):
        compliance += layer_part(patch, specimen.thickness, nu)
    return compliance / specimen.modulus


@lru_cache(maxsize=4)
def half_space_parts(patch: Patch) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Three matrices (3n, 3n) in mm3 that hold for any Poisson's ratio: 1/r, e e/r (tangential), and e/r (coupling)."""

    def kernel(offset):
        r = np.hypot(offset[..., 0], offset[..., 1])
        inverse = np.divide(1.0, r, out=np.zeros_like(r), where=r > 0)
        e = offset * inverse[..., None]
        return np.stack([inverse, *(inverse * part for part in _monomials(e))])

    terms = weak_terms(patch, kernel, linear_moments)
    inverse, xx, xy, yy, x, y = range(6)
    n = len(patch.xy)
    parts = [np.zeros((3, n, 3, n)) for _ in range(3)]
    for a in range(3):
        parts[0][a, :, a] = terms(inverse, a)
    for a, b, term in ((1, 1, xx), (1, 2, xy), (2, 1, xy), (2, 2, yy)):
        parts[1][a, :, b] = terms(term, b)
    for a, term in ((1, x), (2, y)):
        # The specimen feels -q, so what a half-space's tensor has here changes sign
        parts[2][0, :, a] = -terms(term, a)
        parts[2][a, :, 0] = terms(term, 0)
    plain, dyadic, coupled = (symmetric(part.reshape(3 * n, 3 * n)) for part in parts)
    return plain, dyadic, coupled


@lru_cache(maxsize=8)
def layer_part(patch: Patch, thickness: float, nu: float) -> np.ndarray:
    """What bonding to a rigid table at `thickness` mm changes in a half-space of unit modulus: (3n, 3n), mm3 / MPa."""
    green = BondedLayerGreen(thickness, nu)

    def kernel(offset):
        tensor = green(offset)
        return np.stack([tensor[..., 2, 2], *(tensor[..., a, b] for a, b in ((0, 0), (0, 1), (1, 1), (2, 0), (2, 1)))])

    terms = weak_terms(patch, kernel, None)
    n = len(patch.xy)
    part = np.zeros((3, n, 3, n))
    part[0, :, 0] = terms(0, 0)
    for a, b, term in ((1, 1, 1), (1, 2, 2), (2, 1, 2), (2, 2, 3)):
        part[a, :, b] = terms(term, b)
    for a, term in ((1, 4), (2, 5)):
        part[0, :, a] = -terms(term, a)
        part[a, :, 0] = terms(term, 0)
    return symmetric(part.reshape(3 * n, 3 * n))


def _monomials(e):
    """e e (xx, xy, yy) and e (x, y) of unit offsets (..., 2), as five arrays (...)."""
    x, y = e[..., 0], e[..., 1]
    return x * x, x * y, y * y, x, y


def linear_moments(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Integrals (k, 3, 6) of each hat function times (1, e_x^2, e_x e_y, e_y^2, e_x, e_y) / r, exactly, for k points
    (k, 2) in the plane of k triangles (k, 3, 2); e is the unit offset and r the distance from source to point.

    In polar coordinates about the point the radial integral is elementary. With x = source - point, an edge at distance
    d with coordinate s along it, r^2 = d^2 + s^2 and phi = phi_0 + g . x, what is left is, for m = 0, 1, 2 factors x,
    int phi x^m / r^(m+1) dA = sum over edges of d int (phi_0 + g . x / 2) x^m / r^(m+1) ds.
    """
    value, gradient = _hats_at(points, corners)
    total = np.zeros((len(points), 3, 6))
    middle = corners.mean(axis=1)
    for edge in range(3):
        start, end = corners[:, edge], corners[:, (edge + 1) % 3]
        along = (end - start) / np.linalg.norm(end - start, axis=1)[:, None]
        out = np.stack([along[:, 1], -along[:, 0]], axis=1)
        out *= np.sign(np.einsum("kj,kj->k", start - middle, out))[:, None]
        d = np.einsum("kj,kj->k", start - points, out)
        s = np.stack([np.einsum("kj,kj->k", p - points, along) for p in (start, end)])
        for m, columns in ((0, [0]), (1, [4, 5]), (2, [1, 2, 3])):
            # x^m of x = d n + s t, as polynomials in s: (pairs, columns, powers)
            powers = _powers(d, out, along, m)
            slope = np.stack(
                [d[:, None] * (gradient @ out[:, :, None])[..., 0], (gradient @ along[:, :, None])[..., 0]], 2
            )
            integrals = _edge_integrals(d, s, m)
            plain = np.einsum("kcp,kp->kc", powers, integrals[:, : m + 1])
            tilted = np.einsum("kcp,khj,kpj->khc", powers, slope, np.stack([integrals[:, :-1], integrals[:, 1:]], 2))
            # e points from the source to the point: x^m turned, which matters for m = 1
            total[..., columns] += (-1) ** m * (value[:, :, None] * plain[:, None] + tilted / 2)
    return total


def _hats_at(points, corners):
    """Values (k, 3) of the hat functions, continued to the points, and their gradients (k, 3, 2)."""
    edges = np.stack([corners[:, 0] - corners[:, 2], corners[:, 1] - corners[:, 2]], axis=2)
    inverse = np.linalg.inv(edges)
    gradient = np.concatenate([inverse, -inverse.sum(axis=1, keepdims=True)], axis=1)
    first = np.einsum("kij,kj->ki", inverse, points - corners[:, 2])
    return np.column_stack([first, 1 - first.sum(axis=1)]), gradient


def _powers(d, out, along, m):
    """x^m, x = d n + s t, as its distinct components' polynomials in s: (pairs, components, m + 1)."""
    if m == 0:
        return np.ones((len(d), 1, 1))
    across = d[:, None] * out
    if m == 1:
        return np.stack([across, along], axis=2)
    pairs = ((0, 0), (0, 1), (1, 1))
    constant = np.stack([across[:, a] * across[:, b] for a, b in pairs], axis=1)
    linear = np.stack([across[:, a] * along[:, b] + along[:, a] * across[:, b] for a, b in pairs], axis=1)
    return np.stack([constant, linear, np.stack([along[:, a] * along[:, b] for a, b in pairs], axis=1)], axis=2)


def _edge_integrals(d, s, m):
    """d int s^j / r^(m+1) ds over an edge for j = 0 ... m + 1, (pairs, m + 2); zero where the point is on its line."""
    r = np.hypot(s, d)
    off = np.abs(d) > 1e-14 * r.sum(axis=0)
    safe, length = np.where(off, d, 1.0), s[1] - s[0]
    r = np.where(off, r, 1.0)
    change = r[1] - r[0]
    if m == 1:
        turn = np.arctan(s[1] / safe) - np.arctan(s[0] / safe)
        columns = [turn, safe * np.log(r[1] / r[0]), safe * (length - safe * turn)]
    else:
        logarithm = np.where(off, edge_logarithm(s[0], r[0], s[1], r[1], d), 0.0)
        if m == 0:
            columns = [safe * logarithm, safe * change]
        else:
            sine, inverse = s[1] / r[1] - s[0] / r[0], 1 / r[0] - 1 / r[1]
            columns = [sine / safe, safe * inverse, safe * (logarithm - sine), safe * (change - safe**2 * inverse)]
    return np.where(off, np.stack(columns), 0.0).T
