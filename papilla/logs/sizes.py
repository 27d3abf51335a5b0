"""Remarks on numbers whose size belongs to another unit: strain, gram-force, m/s."""

from collections.abc import Iterator

import numpy as np

STRAIN_BELOW = 0.05
"""Microstrain: all readings of a log below it are less than any gauge's noise, and are strain more likely."""

COUNTS_FROM = 3000.0
"""Whole numbers of this size are counts of a converter more likely than rounded microstrain."""

FORCE_ABOVE_N = 20.0
"""A soft finger takes a newton or two; 20 is 20 gf, a light touch."""

SPEED_BELOW_MM_S = 0.5
"""A hand moves by 1 to 500 mm/s, which is 0.001 to 0.5 m/s."""


class Sizes:
    """Largest magnitudes of a log's columns, and whether its readings are whole numbers, block by block."""

    def __init__(self, names: tuple[str, ...], gauges: int):
        self._names, self._gauges = names, gauges
        self._largest, self._whole = np.zeros(len(names)), True

    def add(self, rows: np.ndarray) -> None:
        """Take in rows (n, columns); NaN counts for nothing."""
        known = np.where(np.isfinite(rows), rows, 0.0)
        self._largest = np.maximum(self._largest, np.abs(known).max(axis=0, initial=0))
        self._whole &= bool((known[:, : self._gauges] % 1 == 0).all())

    def remarks(self) -> Iterator[str]:
        """What looks like another unit, and how to say so in a map."""
        gauges = self._largest[: self._gauges].max(initial=0)
        if 0 < gauges < STRAIN_BELOW:
            yield f"no reading is above {gauges:.2g}: this looks like strain, not microstrain" + _mend("g1", "strain")
        elif self._whole and gauges >= COUNTS_FROM:
            yield f"readings are whole numbers up to {gauges:.0f}: this looks like counts" + _mend("g1", "counts")
        for name, largest in zip(self._names[self._gauges :], self._largest[self._gauges :], strict=True):
            if name in ("force_N", "tangential_N") and largest > FORCE_ABOVE_N:
                yield f"{name} comes to {largest:.3g}: this looks like gf" + _mend(name, "gf")
            if name == "velocity_mm_s" and 0 < largest < SPEED_BELOW_MM_S:
                yield f"velocity_mm_s stays below {largest:.2g}: this looks like m/s" + _mend(name, "m/s")


def _mend(column: str, unit: str) -> str:
    return f' (if so: --map with {column} = {{ column = "{column}", unit = "{unit}" }})'
