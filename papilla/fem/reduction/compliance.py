"""Compliance of the specimen on the patch: weak surface displacement under piecewise linear pressure and shear.

Unknowns are [p, q_1, q_2], each nodal (n,), in MPa of the contact plane: p pushes finger and specimen apart; q acts on
the finger along the plane's two axes, and -q on the specimen. Conjugate to them are the closure (the sum of both
surface displacements) and the slip of the finger along the specimen, so compliances are symmetric and add. Without
friction there is only p. In a mirror image the component of q along the mirrored axis has the opposite sign.

The half-space kernels are proportional to 1/r: for pairs of near triangles the inner integral is exact and the outer
one uses Gauss quadrature; for far pairs both use Gauss quadrature. A bonded block adds a smooth kernel, which is
interpolated: with Chebyshev points t of the patch's box and Lagrange polynomials L,

    K(x - y) = sum_ab L_a(x) K(t_a - t_b) L_b(y),

so that the kernel is evaluated at some hundred points instead of thousands.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial

import numpy as np
from numpy.polynomial.chebyshev import chebpts1, chebvander

from papilla.fem.reduction.patch import TRIANGLE_POINTS, Patch, quadrature

NEAR_EDGES = 3.0
"""Pairs closer than this many mean edge lengths are integrated exactly."""

QUADRATURE_ROWS = 256
"""Number of quadrature points that are combined with all others at a time: it limits the memory of large patches."""

CHEBYSHEV_POINTS, SMOOTH_KERNEL_ERROR, CHECKED_POINTS = (8, 12, 18, 27), 1e-8, 48
"""Numbers of points along each axis for the interpolation of a smooth kernel; the error, relative to its largest value,
at which refinement stops; and the number of Gauss points at which the error is measured. A kernel that no grid resolves
is integrated by Gauss quadrature."""


TRACTION_COMPONENTS = 3
"""Pressure and the two tangential tractions."""


def half_space_compliance(patch: Patch) -> np.ndarray:
    """Matrix (n, n), in mm3, whose product with pressure / E* is the weak displacement of a half-space."""
    terms = _weak(patch, lambda offset: _inverse(offset)[None], partial(linear_moments, orders=(0,)))
    return _symmetric(terms(0, 0)) / np.pi


@lru_cache(maxsize=8)
def kernel_compliance(patch: Patch, kernel: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Matrix (n, n), in mm4 times the kernel's unit, of a smooth kernel of distance (mm)."""
    return _symmetric(_smooth(patch, lambda offset: kernel(np.linalg.norm(offset, axis=-1))[None])(0, 0))


@dataclass(frozen=True, eq=False)
class PatchSurface:
    """A patch on which a specimen computes its compliance (`papilla.model.specimen.Surface`); n patch nodes.

    known : (n, n) result of `half_space_compliance`, if it is known already.
    """

    patch: Patch
    known: np.ndarray | None = None

    @cached_property
    def half_space(self) -> np.ndarray:
        """(n, n) of `half_space_compliance`."""
        return half_space_compliance(self.patch) if self.known is None else self.known

    def kernel(self, kernel: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Weak compliance (n, n) of a smooth kernel: mm per N at a distance in mm."""
        return kernel_compliance(self.patch, kernel)

    def half_space_tractions(self, nu: float) -> np.ndarray:
        """Weak compliance (3n, 3n), in mm3 / MPa, of a half-space of 1 MPa; its first (n, n) block is the normal
        one."""
        plain, dyadic, coupling = half_space_parts(self.patch)
        return (1 + nu) / np.pi * ((1 - nu) * plain + nu * dyadic + (1 - 2 * nu) / 2 * coupling)

    def green_tractions(self, green: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Weak compliance (3n, 3n) of a smooth Green's tensor, displacement per force at offsets (..., 2) in mm."""
        return green_compliance(self.patch, green)


@lru_cache(maxsize=4)
def half_space_parts(patch: Patch) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Three matrices (3n, 3n) in mm3 that hold for any Poisson's ratio: the terms 1/r, e e/r (tangential) and e/r
    (coupling)."""

    def kernel(offset):
        inverse = _inverse(offset)
        x, y = np.moveaxis(offset * inverse[..., None], -1, 0)
        return np.stack([inverse, *(inverse * moment for moment in (x * x, x * y, y * y, x, y))])

    terms = _weak(patch, kernel, linear_moments)
    n = len(patch.xy)
    plain = np.zeros((TRACTION_COMPONENTS, n, TRACTION_COMPONENTS, n))
    for a in range(TRACTION_COMPONENTS):
        plain[a, :, a] = terms(0, a)
    plain, dyadic, coupled = (_symmetric(matrix) for matrix in (plain, *_tangential(terms, n)))
    return plain, dyadic, coupled


def _tangential(terms, n: int) -> np.ndarray:
    """Two matrices (2, 3, n, 3, n) of the terms 1 to 5 of a kernel: xx, xy, yy between the tangential components, and
    x, y between these and the normal one."""
    dyadic, coupled = both = np.zeros((2, TRACTION_COMPONENTS, n, TRACTION_COMPONENTS, n))
    for a, b, term in ((1, 1, 1), (1, 2, 2), (2, 1, 2), (2, 2, 3)):
        dyadic[a, :, b] = terms(term, b)
    for a, term in ((1, 4), (2, 5)):
        # The traction on the specimen is -q, so the components that couple p and q change sign
        coupled[0, :, a] = -terms(term, a)
        coupled[a, :, 0] = terms(term, 0)
    return both


@lru_cache(maxsize=8)
def green_compliance(patch: Patch, green: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Weak compliance (3n, 3n) of a smooth Green's tensor (..., 3, 3), z into the specimen, of offsets (..., 2)."""

    def kernel(offset):
        tensor = green(offset)
        return np.stack([tensor[..., 2, 2], *(tensor[..., a, b] for a, b in ((0, 0), (0, 1), (1, 1), (2, 0), (2, 1)))])

    terms = _smooth(patch, kernel)
    n = len(patch.xy)
    compliance = _tangential(terms, n).sum(axis=0)
    compliance[0, :, 0] = terms(0, 0)
    return _symmetric(compliance)


def _inverse(offset: np.ndarray) -> np.ndarray:
    """1/r (...) of offsets (..., 2), and 0 for zero offsets: near pairs are integrated separately."""
    r = np.hypot(offset[..., 0], offset[..., 1])
    return np.divide(1.0, r, out=np.zeros_like(r), where=r > 0)


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    """The symmetric part of a matrix (n, n), or of one (c, n, c, n) with c components, as (c n, c n)."""
    matrix = matrix.reshape(2 * [math.isqrt(matrix.size)])
    matrix = (matrix + matrix.T) / 2
    matrix.flags.writeable = False
    return matrix


def _smooth(patch: Patch, kernel):
    """As `_weak`, for a kernel that is smooth everywhere."""
    points, weights, hats = quadrature(patch)
    low, high = points.min(axis=0), points.max(axis=0)
    scaled = (2 * points - low - high) / (high - low)
    checked = np.unique(np.linspace(0, len(points) - 1, CHECKED_POINTS).astype(int))
    exact = [kernel(points[checked, None] - (points[checked] * image)[None]) for image in patch.images]
    # Refine until the interpolated kernel agrees with the kernel itself at some pairs of points. A grid with more nodes
    # than there are points saves nothing.
    for count in CHEBYSHEV_POINTS:
        if 2 * count**2 > len(points):
            break
        nodes = chebpts1(count)
        # Lagrange polynomials from Chebyshev's, which are orthogonal on these nodes
        lagrange = [np.linalg.solve(chebvander(nodes, count - 1).T, chebvander(x, count - 1).T).T for x in scaled.T]
        basis = (lagrange[0][:, :, None] * lagrange[1][:, None, :]).reshape(len(points), -1)
        unit_grid = np.stack(np.meshgrid(nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 2)
        grid = (unit_grid * (high - low) + low + high) / 2
        values = [kernel(grid[:, None] - (grid * image)[None]) for image in patch.images]
        interpolated = [basis[checked] @ value @ basis[checked].T for value in values]
        if np.max(np.abs(np.subtract(interpolated, exact))) <= SMOOTH_KERNEL_ERROR * np.max(np.abs(exact)):
            loaded = hats.multiply(weights[:, None]).T @ basis
            return _by_component(patch, [loaded @ value @ loaded.T for value in values])
    return _weak(patch, kernel, None)


def _by_component(patch: Patch, per_image: list[np.ndarray]):
    """Function (k, c) of the sum over all images, (terms, n, n): sources of component c are mirrored with the
    images."""
    signs = np.column_stack([np.ones(len(patch.images)), patch.images])

    def terms(k: int, c: int) -> np.ndarray:
        return np.einsum("i,iab->ab", signs[:, c], np.stack([total[k] for total in per_image]))

    return terms


def _weak(patch: Patch, kernel, exact):
    """terms(k, c) -> (n, n): double integral of term k of the kernel between hat functions, for sources of component c.

    `kernel` maps offsets (..., 2) from source to point onto (terms, ...); `exact`, where the kernel is singular, gives
    the integrals (pairs, 3, terms) of the terms times a near triangle's hat functions.
    """
    points, weights, hats = quadrature(patch)
    loaded = hats.multiply(weights[:, None]).tocsr()
    per_image = []
    for image in patch.images:
        source, total = points * image, np.zeros(())
        # In blocks of rows, because a kernel between all pairs of points may not fit into memory.
        for first in range(0, len(points), QUADRATURE_ROWS):
            rows = slice(first, first + QUADRATURE_ROWS)
            values = kernel(points[rows, None] - source[None])
            potentials = np.stack([(loaded.T @ value.T).T for value in values])
            total = total + np.stack([loaded[rows].T @ potential for potential in potentials])
        if exact is not None:
            total = total + _near(patch, points, loaded, image, kernel, exact)
        per_image.append(total)
    return _by_component(patch, per_image)


def _near(patch, points, loaded, image, kernel, exact) -> np.ndarray:
    """Change (terms, n, n) when near triangles are integrated exactly."""
    from scipy.spatial import cKDTree

    corners = patch.xy[patch.triangles]
    size = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean(axis=1)
    flipped = corners * image
    # Pairs of a point and a triangle: only the point's distance decides, relative to the size of the triangle.
    near = cKDTree(points).query_ball_point(flipped.mean(axis=1), NEAR_EDGES * size)
    triangle = np.repeat(np.arange(len(corners)), [len(neighbours) for neighbours in near])
    point = np.concatenate([np.array(neighbours, dtype=int) for neighbours in near])
    # Near pairs were already counted by quadrature: replace that by the exact integral.
    change = exact(points[point], flipped[triangle]) - _gauss(points[point], flipped[triangle], kernel)
    n, nodes = len(patch.xy), patch.triangles[triangle]
    total = np.zeros((change.shape[2], len(points), n))
    for k, values in enumerate(total):
        np.add.at(values, (point[:, None], nodes), change[:, :, k])
    return np.stack([loaded.T @ values for values in total])


def _gauss(points, corners, kernel) -> np.ndarray:
    """(pairs, 3, terms) three-point quadrature of the kernel times hat functions."""
    source = np.einsum("ql,klj->kqj", TRIANGLE_POINTS, corners)
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    return np.einsum("k,tkq,ql->klt", area / 3, kernel(points[:, None] - source), TRIANGLE_POINTS)


MOMENT_COLUMNS = ([0], [4, 5], [1, 2, 3])
"""Columns of `linear_moments` with none, one and two factors e."""


def linear_moments(points: np.ndarray, corners: np.ndarray, orders: tuple[int, ...] = (0, 1, 2)) -> np.ndarray:
    """Integrals (k, 3, 6) of each hat function times (1, e_x^2, e_x e_y, e_y^2, e_x, e_y) / r, exactly, for k points
    (k, 2) in the plane of k triangles (k, 3, 2); e is the unit offset and r the distance from source to point.

    In polar coordinates about the point the radial integral is elementary. With x = source - point, an edge at distance
    d with coordinate s along it, r^2 = d^2 + s^2 and phi = phi_0 + g . x, what is left is, for m = 0, 1, 2 factors x,
    int phi x^m / r^(m+1) dA = sum over edges of d int (phi_0 + g . x / 2) x^m / r^(m+1) ds; m = 0 is that of Wilton et
    al. 1984, doi:10.1109/TAP.1984.1143304. `orders` are the m that are wanted; m = 0 alone gives (k, 3, 1).
    """
    value, gradient = _hats_at(points, corners)
    total = np.zeros((len(points), 3, 6 if orders != (0,) else 1))
    middle = corners.mean(axis=1)
    for edge in range(corners.shape[1]):
        # Outward normal n and tangent t of the edge; the point lies at the signed distance d from its line, positive
        # inside, so that edges of a triangle that does not contain the point cancel where they should.
        start, end = corners[:, edge], corners[:, edge - 2]
        along = (end - start) / np.linalg.norm(end - start, axis=1)[:, None]
        out = np.stack([along[:, 1], -along[:, 0]], axis=1)
        out *= np.sign(np.einsum("kj,kj->k", start - middle, out))[:, None]
        d = np.einsum("kj,kj->k", start - points, out)
        s = np.stack([np.einsum("kj,kj->k", p - points, along) for p in (start, end)])
        for m in orders:
            # x^m of x = d n + s t, as polynomials in s: (pairs, columns, powers)
            powers = _powers(d, out, along, m)
            outwards, lengthwise = ((gradient @ axis[:, :, None])[..., 0] for axis in (out, along))
            slope = np.stack([d[:, None] * outwards, lengthwise], 2)
            integrals = _edge_integrals(d, s, m)
            plain = np.einsum("kcp,kp->kc", powers, integrals[:, : m + 1])
            tilted = np.einsum("kcp,khj,kpj->khc", powers, slope, np.stack([integrals[:, :-1], integrals[:, 1:]], 2))
            # e points from the source to the point: x^m has the opposite sign, which matters for m = 1
            total[..., MOMENT_COLUMNS[m]] += (-1) ** m * (value[:, :, None] * plain[:, None] + tilted / 2)
    return total


def _hats_at(points, corners):
    """Values (k, 3) of the hat functions, continued linearly to the points, and their gradients (k, 3, 2)."""
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
        # ln((R+ + s+) / (R- + s-)), in the form without cancellation
        forward = s[0] + s[1] > 0
        upper, lower = (np.where(forward, r[a] + s[a], r[b] - s[b]) for a, b in ((1, 0), (0, 1)))
        logarithm = np.log(np.where(off, upper, 1.0) / np.where(off, lower, 1.0))
        if m == 0:
            columns = [safe * logarithm, safe * change]
        else:
            sine, inverse = s[1] / r[1] - s[0] / r[0], 1 / r[0] - 1 / r[1]
            columns = [sine / safe, safe * inverse, safe * (logarithm - sine), safe * (change - safe**2 * inverse)]
    return np.where(off, np.stack(columns), 0.0).T
