"""Factorisation of symmetric indefinite matrices: rslab's LDL^T, with SciPy's SuperLU as the fallback.

Every factorisation is checked by its inertia (if the method gives it), every solve by its residual.
"""

import os
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from papilla.core.errors import SolverError
from papilla.core.memory import refuse_beyond

SOLVE_RESIDUAL_BOUND = 1e-10
"""Largest accepted relative residual of a solve."""

REFINED_RESIDUAL = SOLVE_RESIDUAL_BOUND / 10
"""Residual of a random combination of columns at which refinement ends, unless it stops falling before: a single column
may be a few times worse."""

MOST_REFINEMENTS = 20
"""Largest number of steps of iterative refinement; if the residual is then above the bound, an error is raised."""

RIGHT_SIDES_AT_ONCE = 32
"""Number of right-hand sides that are solved at once: rslab's work memory is nine times theirs, and a factor keeps
it."""

RSLAB_ORDERING = {"ordering": "metis", "relax": True}
"""rslab by default compares four orderings. Nested dissection is the best one for fingers, and alone it takes half the
time of the analysis. Wider supernodes with some zeros take 0.85 of the time (default finger, one core: 1.9 to 1.3
s)."""

SUPERLU_BYTES = 2700
"""Peak memory of SuperLU over unknowns^(4/3), measured at 23,863 unknowns of the default finger: 1.8 GB (rslab:
0.2)."""

SOLVER_ENGINES = ("rslab", "superlu")


@dataclass(frozen=True, eq=False)
class Factor:
    """A factorised symmetric matrix that solves to a checked residual.

    `engine` names the method; `inertia` is (positive, negative, zero) eigenvalue counts or None if not known.
    """

    matrix: sp.csc_matrix
    engine: str
    inertia: tuple[int, int, int] | None
    nonzeros: int
    _solve_many: Callable[[np.ndarray], np.ndarray]

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """Solution (n, k) of `matrix @ x = rhs` for rhs (n, k).

        Raises `SolverError` if the residual of the block stays above `SOLVE_RESIDUAL_BOUND` after refinement.
        """
        rhs = np.ascontiguousarray(rhs, dtype=float)
        solution = self._solve_batches(rhs)
        before, residual = np.inf, self._probe(solution, rhs)
        for _ in range(MOST_REFINEMENTS):
            if residual <= REFINED_RESIDUAL or before / 2 < residual <= SOLVE_RESIDUAL_BOUND:
                break
            solution = solution + self._solve_batches(rhs - self._apply(solution))
            before, residual = residual, self._probe(solution, rhs)
        if residual <= SOLVE_RESIDUAL_BOUND:
            return solution
        raise SolverError(
            f"{self.engine} left a relative residual of {residual:.1e}, more than {SOLVE_RESIDUAL_BOUND:.0e}"
        )

    def solve_once(self, rhs: np.ndarray) -> np.ndarray:
        """Solution (n,) for one right-hand side (n,), neither checked nor refined: for an iteration that measures its
        own residual."""
        return self._solve_many(np.ascontiguousarray(rhs[:, None], dtype=float))[:, 0]

    def _solve_batches(self, rhs: np.ndarray) -> np.ndarray:
        solution = np.empty_like(rhs)
        for first in range(0, rhs.shape[1], RIGHT_SIDES_AT_ONCE):
            batch = slice(first, first + RIGHT_SIDES_AT_ONCE)
            solution[:, batch] = self._solve_many(np.ascontiguousarray(rhs[:, batch]))
        return solution

    def _apply(self, x: np.ndarray) -> np.ndarray:
        return self.matrix @ x + self.matrix.T @ x - self.matrix.diagonal()[:, None] * x

    def _probe(self, solution: np.ndarray, rhs: np.ndarray) -> float:
        """Relative residual of a random combination of the columns: any wrong column shows in it, at the cost of
        one."""
        scale = np.linalg.norm(rhs, axis=0)
        mix = np.random.default_rng(0).standard_normal(rhs.shape[1]) / np.where(scale > 0, scale, 1.0)
        difference = self._apply((solution @ mix)[:, None])[:, 0] - rhs @ mix
        size = np.linalg.norm(mix * scale)
        return float(np.linalg.norm(difference) / size) if size > 0 else 0.0


def factorise(
    matrix: sp.csc_matrix, negative: int, *, stabilised: sp.csc_matrix | None = None, engine: str | None = None
) -> Factor:
    """Factor a symmetric matrix given by its lower triangle.

    Parameters
    ----------
    matrix : (n, n) lower triangle.
    negative : number of negative eigenvalues that it must have (the pressures). rslab counts them, and its factor is
        refused for another number; SuperLU does not, so for it the residual of each solve is the only check.
    stabilised : a similar matrix that is factored instead; solves are then refined with `matrix`.
    engine : "rslab" or "superlu"; by default the environment variable PAPILLA_SOLVER, else rslab with SuperLU as
        fallback.

    Raises `SolverError` if no engine factors the matrix; warns if SuperLU had to.
    """
    wanted = engine or os.environ.get("PAPILLA_SOLVER") or SOLVER_ENGINES[0]
    if wanted not in SOLVER_ENGINES:
        raise SolverError(f"solver must be one of {', '.join(SOLVER_ENGINES)}, got {wanted!r}")
    to_factor = matrix if stabilised is None else stabilised
    if wanted == "rslab":
        try:
            return _factor_rslab(matrix, to_factor, negative)
        except (ImportError, RuntimeError) as error:
            warnings.warn(f"rslab did not factor the matrix ({error}); using SuperLU, which is slower", stacklevel=2)
    return _factor_superlu(matrix, to_factor)


def _factor_rslab(matrix, to_factor, negative) -> Factor:
    """Factor by rslab. Raises `SolverError` if the inertia is not the expected one, and rslab's own errors."""
    import rslab

    symbolic = rslab.analyze(to_factor, path="ldlt", **RSLAB_ORDERING, threads=os.cpu_count() or 1)
    _refuse_factor(symbolic.memory_plan(nrhs=RIGHT_SIDES_AT_ONCE)["peak_bytes"], to_factor)
    solver = symbolic.factor(to_factor)
    inertia = tuple(int(count) for count in solver.inertia)
    expected = (matrix.shape[0] - negative, negative, 0)
    if inertia != expected:
        raise SolverError(f"inertia {inertia} where {expected} was expected")
    return Factor(matrix, "rslab", inertia, int(solver.factor_nnz), solver.solve_many)


def _refuse_factor(needed: float, matrix: sp.csc_matrix) -> None:
    refuse_beyond(needed, f"factorising {matrix.shape[0]:,} unknowns", lambda _: "take a coarser mesh")


def _factor_superlu(matrix, to_factor) -> Factor:
    """Factor by SuperLU, which needs the whole symmetric matrix; raises `SolverError`."""
    _refuse_factor(SUPERLU_BYTES * matrix.shape[0] ** (4 / 3), matrix)
    full = (to_factor + sp.tril(to_factor, -1).T).tocsc()
    try:
        lu = splu(full, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options={"SymmetricMode": True})
    except RuntimeError as error:
        raise SolverError(f"SuperLU could not factor the matrix: {error}") from error
    return Factor(matrix, "superlu", None, int(lu.L.nnz + lu.U.nnz), lu.solve)
