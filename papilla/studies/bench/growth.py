"""How cost grows with the number of unknowns n: fitted powers of n, beside what nested dissection needs in 3-D.

For a cube of n unknowns nested dissection fills O(n^(4/3)) entries of the factor with O(n^2) operations, and no
ordering does with less (George 1973, doi:10.1137/0710032); a solve touches each entry once. A mesh that is fine at the
contact alone lies between a cube and a sheet, where the same bounds are n log n and n^(3/2).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from papilla.studies.bench.row import BenchRow


@dataclass(frozen=True)
class Power:
    """A quantity fitted by coefficient * n^exponent, and the exponent of its bound for a cube."""

    exponent: float
    bound: float
    coefficient: float

    @classmethod
    def fitted(cls, dofs: Sequence[float], values: Sequence[float], bound: float) -> "Power":
        """Least squares of log value against log n."""
        exponent, offset = np.polyfit(np.log(dofs), np.log(values), 1)
        return cls(float(exponent), bound, float(np.exp(offset)))


@dataclass(frozen=True)
class Growth:
    """Powers of the number of unknowns, fitted over `dofs`, of one element's factor and its use."""

    element: str
    dofs: tuple[int, ...]
    factor_nonzeros: Power
    factor_flops: Power
    factor_seconds: Power
    solve_seconds: Power

    @classmethod
    def of(cls, rows: Sequence[BenchRow]) -> "Growth":
        """Growth over rows of one element on at least two meshes."""
        ordered = sorted(rows, key=lambda row: row.dofs)
        columns = zip(
            *((r.factor_nonzeros, r.factor_flops, r.stages["factorisation"], r.seconds_per_column) for r in ordered),
            strict=True,
        )
        dofs = tuple(row.dofs for row in ordered)
        powers = (Power.fitted(dofs, own, bound) for own, bound in zip(columns, (4 / 3, 2.0, 2.0, 4 / 3), strict=True))
        return cls(ordered[0].element, dofs, *powers)
