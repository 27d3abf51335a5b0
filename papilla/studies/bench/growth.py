"""How cost grows with the number of unknowns n: fitted powers of n, beside what nested dissection needs in 3-D.

For a cube of n unknowns nested dissection fills O(n^(4/3)) entries of the factor with O(n^2) operations, and no
ordering does with less (George 1973, doi:10.1137/0710032); a solve touches each entry once. A mesh that is fine at the
contact alone lies between a cube and a sheet, where the same bounds are n log n and n^(3/2).
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from papilla.studies.bench.measure import Measured

NONZEROS_BOUND, FLOPS_BOUND, SOLVE_BOUND = 4 / 3, 2.0, 4 / 3


@dataclass(frozen=True)
class Power:
    """A quantity fitted by coefficient * n^exponent, and the exponent of its bound for a cube."""

    exponent: float
    bound: float
    coefficient: float


@dataclass(frozen=True)
class Growth:
    """Powers of the number of unknowns, fitted over `dofs`, of one element's factor and its use."""

    element: str
    dofs: tuple[int, ...]
    factor_nonzeros: Power
    factor_flops: Power
    factor_seconds: Power
    solve_seconds: Power

    def to_json(self) -> dict:
        """Plain values."""
        return asdict(self)


def growth_of(element: str, measured: Sequence[Measured]) -> Growth:
    """Growth over measurements of one element on at least two meshes."""
    ordered = sorted(measured, key=lambda one: one.dofs)
    dofs = np.array([one.dofs for one in ordered], dtype=float)
    return Growth(
        element,
        tuple(one.dofs for one in ordered),
        fitted(dofs, [float(one.factor_nonzeros or 0) for one in ordered], NONZEROS_BOUND),
        fitted(dofs, [one.factor_flops or 0.0 for one in ordered], FLOPS_BOUND),
        fitted(dofs, [one.stages["factorisation"] for one in ordered], FLOPS_BOUND),
        fitted(dofs, [one.seconds_per_column or 0.0 for one in ordered], SOLVE_BOUND),
    )


def fitted(dofs: np.ndarray, values: Sequence[float], bound: float) -> Power:
    """Least squares of log value against log n."""
    exponent, offset = np.polyfit(np.log(dofs), np.log(np.asarray(values)), 1)
    return Power(float(exponent), bound, float(np.exp(offset)))
