"""Fits smooth surfaces over (ln force, ln modulus) to presses, and finds the part of the S_d surface that can be
inverted.

A surface is a tensor product of two axes, s(x, y) = sum_ij c_ij B_i(x) B_j(y) with x = ln f and y = ln E. An axis with
many values is a cubic B-spline; one with few values is one polynomial, written in the same B-splines, so that all
surfaces are stored and evaluated alike. The coefficients minimise

    |values - A c|^2 + |fourth differences of c|^2 (small weight),

whose second term only decides where presses are missing: a cubic costs nothing. A and its factor depend on the presses
alone, so S_d and every gauge share them. In each cell the surface is a polynomial; its Bernstein coefficients bound its
slope in y, which proves for the whole cell that S_d rises with E and can be inverted.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array, eye_array, kron
from scipy.sparse.linalg import splu
from scipy.special import stdtrit

from papilla.calibration import INTERVAL_PROBABILITY, NORMAL_FACTOR, Uncertainty
from papilla.calibration.surface import SPLINE_DEGREE, SPLINE_ORDER, Axis, BicubicSurface
from papilla.core import checks
from papilla.core.errors import InputError

ROUGHNESS_WEIGHT = 1e-3
"""Weight of a squared fourth difference, relative to the mean weight of a coefficient: it only determines the edges."""
FEW_VALUES = 10
"""Number of distinct values along an axis below which one polynomial replaces the cells."""
CELLS_PER_VALUE = 0.9
POLYNOMIAL_CELLS = 16
"""Number of cells for a polynomial, each of which is checked separately for rising S_d."""
SCATTER_BINS = 8
PROBES_PER_AXIS = 32


@dataclass(frozen=True)
class Resolution:
    """Resolution along one axis: a cubic spline of `cells`, or one polynomial of `degree` <= 3 over all of them."""

    cells: int
    degree: int | None = None

    @property
    def transform(self) -> np.ndarray:
        """(cells + 3, p): B-spline coefficients of the p free parameters (powers on [-1, 1], for a polynomial)."""
        if self.degree is None:
            return np.eye(self.cells + SPLINE_DEGREE)
        # Blossoms of the powers at the inner knots of each B-spline (Ramshaw 1989, doi:10.1016/0167-8396(89)90032-0).
        u, v, w = (
            2 * (np.arange(self.cells + SPLINE_DEGREE) - shift) / self.cells - 1
            for shift in reversed(range(SPLINE_DEGREE))
        )
        blossoms = np.column_stack(
            [np.ones_like(u), (u + v + w) / SPLINE_DEGREE, (u * v + u * w + v * w) / SPLINE_DEGREE, u * v * w]
        )
        return blossoms[:, : self.degree + 1]

    @property
    def roughness(self) -> np.ndarray:
        """(p, p) squared fourth differences of the parameters, which vanish for a cubic; none for a polynomial."""
        if self.degree is not None:
            return np.zeros((self.degree + 1, self.degree + 1))
        differences = np.diff(np.eye(self.cells + SPLINE_DEGREE), SPLINE_ORDER, axis=0)
        return ROUGHNESS_WEIGHT * differences.T @ differences

    def basis(self, axis: Axis, values: np.ndarray) -> np.ndarray:
        """(n, p) weights of the parameters at n values."""
        if self.degree is None:
            return axis.basis(values)
        place = 2 * (np.log(values) - axis.start) / (axis.step * axis.cells) - 1
        return place[:, None] ** np.arange(self.degree + 1)


def table_resolution(values: np.ndarray) -> Resolution:
    """The finest axis that a computed, noise-free table supports: cells, or a polynomial if there are few values."""
    count = len(np.unique(values))
    if count < FEW_VALUES:
        return Resolution(POLYNOMIAL_CELLS, min(count - 1, SPLINE_DEGREE))
    return Resolution(round(CELLS_PER_VALUE * count))


@dataclass(frozen=True)
class Fitted:
    """A fitted surface, the rms error for a new press, the 95 % half width in units of that rms, and the residuals
    (n,)."""

    surface: BicubicSurface
    rms: float
    factor: float
    residual: np.ndarray

    @property
    def largest(self) -> float:
        """Largest |residual|."""
        return float(np.abs(self.residual).max())


class SurfaceFit:
    """One factorised least-squares problem for all surfaces over the same n presses (S_d's and each gauge's).

    Parameters
    ----------
    along : resolution along force and modulus.

    Raises `InputError` if forces or moduli do not vary, or if the presses are too few or badly placed.
    """

    def __init__(self, force_N: np.ndarray, modulus_MPa: np.ndarray, along: tuple[Resolution, Resolution]):
        for name, values in (("forces", force_N), ("moduli", modulus_MPa)):
            if len(np.unique(values)) < 2:
                raise InputError(f"a surface needs presses at two {name} at least, got {len(np.unique(values))}")
        self.along = along
        self.force_N = (float(force_N.min()), float(force_N.max()))
        self.modulus_MPa = (float(modulus_MPa.min()), float(modulus_MPa.max()))
        self._transforms = [resolution.transform for resolution in along]
        self._axes = (Axis.between(*self.force_N, along[0].cells), Axis.between(*self.modulus_MPa, along[1].cells))
        p, q = (transform.shape[1] for transform in self._transforms)
        self._design = self._rows(force_N, modulus_MPa)
        # The mean weight of a coefficient: with it the penalty has the same effect for many presses as for few.
        share = len(force_N) / (p * q)
        penalty = share * (kron(along[0].roughness, eye_array(q)) + kron(eye_array(p), along[1].roughness))
        gram = (self._design.T @ self._design).tocsc()
        try:
            self._solver = splu((gram + penalty).tocsc())
        except RuntimeError as error:
            raise InputError(f"{len(force_N)} presses do not determine a surface of {p * q} coefficients") from error
        self.freedom = len(force_N) - self._parameters(gram, p * q)

    def _rows(self, force_N: np.ndarray, modulus_MPa: np.ndarray) -> csr_array:
        """(n, parameters) weights at n points."""
        over_force, over_modulus = (
            resolution.basis(axis, values)
            for resolution, axis, values in zip(self.along, self._axes, (force_N, modulus_MPa), strict=True)
        )
        p, q = over_force.shape[1], over_modulus.shape[1]
        # Row by row, the product of every weight along force with every weight along modulus.
        repeated, tiled = kron(csr_array(over_force), np.ones((1, q))), kron(np.ones((1, p)), csr_array(over_modulus))
        return csr_array(repeated.tocsr().multiply(tiled.tocsr()))

    def _parameters(self, gram, size: int) -> float:
        """Effective parameters, trace of (G + P)^-1 G, by probes (Hutchinson 1990, doi:10.1080/03610919008812866)."""
        if all(resolution.degree is not None for resolution in self.along):
            return float(size)
        probes = np.random.default_rng(0).choice([-1.0, 1.0], size=(size, PROBES_PER_AXIS))
        return float((probes * self._solver.solve(gram @ probes)).sum() / PROBES_PER_AXIS)

    def surface(self, values: np.ndarray) -> Fitted:
        """The surface fitted to (n,) values, and its errors.

        The rms is that of the residuals with n - p degrees of freedom (p effective parameters), times sqrt(1 + p / n)
        for the effect of noise on the surface itself. Without degrees of freedom it is 0: the fit then says nothing
        about its error.
        """
        parameters = self._solver.solve(self._design.T @ values)
        residual = values - self._design @ parameters
        over_force, over_modulus = self._transforms
        table = over_force @ parameters.reshape(over_force.shape[1], over_modulus.shape[1]) @ over_modulus.T
        rms, factor = 0.0, NORMAL_FACTOR
        if self.freedom >= 0.5:
            # n - p = freedom, so 1 + p / n = 2 - freedom / n.
            rms = float(np.sqrt(residual @ residual / self.freedom * (2 - self.freedom / len(values))))
            factor = float(stdtrit(self.freedom, 0.5 + INTERVAL_PROBABILITY / 2))
        return Fitted(BicubicSurface(self.force_N, self.modulus_MPa, table), rms, factor, residual)


def usable_part(
    surface: BicubicSurface,
    missing_force: ArrayLike = (),
    missing_modulus: ArrayLike = (),
    forces: ArrayLike = (),
    moduli: ArrayLike = (),
) -> tuple[np.ndarray, np.ndarray]:
    """The part of ln S_d that has an inverse.

    Parameters
    ----------
    missing_force, missing_modulus : presses of the table (k,) that have no readings.
    forces, moduli : all values of the table, rising; a missing press makes the cells up to its neighbours unusable.

    Returns
    -------
    usable : (m, 2) per force cell, first and last node of the longest run of cells in which S_d rises and there are
    data.
    twofold : (m, 2) range of values that also occur in falling cells; NaN if none falls.
    """
    rising = _slope_bounds(surface).min(axis=(-2, -1)) > 0
    supported = np.ones_like(rising)
    for force, modulus in zip(np.asarray(missing_force), np.asarray(missing_modulus), strict=True):
        # Between a missing press and its neighbours the surface is a guess.
        supported[_around(surface.force_axis, forces, force), _around(surface.modulus_axis, moduli, modulus)] = False
    usable = np.array([_longest_run(cells) for cells in rising & supported])
    # A value that also occurs where S_d falls has two moduli: the ranges of these cells are kept, to refuse it.
    bounds = _value_bounds(surface)
    falling = ~rising & supported
    low = np.where(falling, bounds.min(axis=(-2, -1)), np.inf).min(axis=1)
    high = np.where(falling, bounds.max(axis=(-2, -1)), -np.inf).max(axis=1)
    twofold = np.where(falling.any(axis=1)[:, None], np.column_stack([low, high]), np.nan)
    return usable, twofold


def uncertainty(
    fitted: Fitted, others: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]] = (), *, one_site: bool = False
) -> Uncertainty:
    """Uncertainty of a fit: its residuals, and the differences of independent meshes from it.

    others : per mesh (force_N, modulus_MPa, value), values in the units of the surface. The scatter is the rms of the
    differences over meshes and moduli, in bins of force; a mesh's difference is systematic, so it does not average out.
    Contacts of different bins lie on different elements, so the interval uses Student's t with meshes x bins. A value
    that is read at `one_site` depends on the same elements at every force, so its interval uses t with the number of
    meshes.
    """
    surface, residuals = fitted.surface, (fitted.rms, fitted.factor, fitted.largest)
    if not others:
        return Uncertainty(*residuals, np.array(surface.force_N), np.zeros(2), 0.0, 0)
    force, modulus, value = (np.concatenate(parts) for parts in zip(*others, strict=True))
    difference = value - surface(force, modulus)
    shared = np.isfinite(difference)
    if not shared.any():
        raise InputError("the sweeps on other meshes share no force and modulus with this one")
    bins = Axis.between(*surface.force_N, SCATTER_BINS)
    number, _, _ = bins.locate(force[shared])
    counts = np.bincount(number, minlength=SCATTER_BINS)
    squares = np.bincount(number, weights=difference[shared] ** 2, minlength=SCATTER_BINS)
    filled = counts > 0
    middles = np.exp(bins.start + bins.step * (np.arange(SCATTER_BINS) + 0.5))
    factor = float(stdtrit(len(others) * (1 if one_site else filled.sum()), 0.5 + INTERVAL_PROBABILITY / 2))
    return Uncertainty(*residuals, middles[filled], np.sqrt(squares[filled] / counts[filled]), factor, len(others))


def _bernstein(degree: int) -> np.ndarray:
    """(powers, degree + 1) Bernstein coefficients of the powers of the place in a cell."""
    return np.array([[comb(k, a) / comb(degree, a) for k in range(degree + 1)] for a in range(degree + 1)])


def _value_bounds(surface: BicubicSurface) -> np.ndarray:
    """(m, n, 4, 4) Bernstein coefficients of each cell: its values lie between their least and their greatest."""
    cubic = _bernstein(SPLINE_DEGREE)
    return np.einsum("ak,ijab,bl->ijkl", cubic, surface.polynomials, cubic)


def _slope_bounds(surface: BicubicSurface) -> np.ndarray:
    """(m, n, 4, 3) Bernstein coefficients of d/du in each cell: above 0 all, the surface rises with the modulus."""
    slope = surface.polynomials[..., 1:] * np.arange(1.0, SPLINE_ORDER)
    return np.einsum("ak,ijab,bl->ijkl", _bernstein(SPLINE_DEGREE), slope, _bernstein(SPLINE_DEGREE - 1))


def _around(axis: Axis, values: ArrayLike, value: float) -> slice:
    """The cells that overlap the open interval between the neighbours of one of the rising values, or between the value
    and its neighbour at an end."""
    nodes = np.asarray(values)
    place = int(np.searchsorted(nodes, value))
    ends = nodes[[max(place - 1, 0), min(place + 1, len(nodes) - 1)]]
    first, last = ((np.log(end) - axis.start) / axis.step for end in ends)
    begin, end = int(np.floor(first + checks.ROUNDING_SHARE)), int(np.ceil(last - checks.ROUNDING_SHARE))
    return slice(*np.clip((begin, end), 0, axis.cells).tolist())


def _longest_run(cells: np.ndarray) -> tuple[int, int]:
    """First and last node of the longest run of true cells; equal if there is none."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], cells.astype(int), [0]])))
    starts, ends = edges[::2], edges[1::2]
    if not len(starts):
        return 0, 0
    best = int(np.argmax(ends - starts))
    return int(starts[best]), int(ends[best])
