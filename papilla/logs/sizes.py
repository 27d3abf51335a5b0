"""Remarks on numbers whose size suggests another unit: strain, counts, gram-force, m/s."""

from collections.abc import Iterator, Mapping

import numpy as np

STRAIN_BELOW = 0.05
"""Microstrain. A log whose readings are all smaller is probably in strain: gauges have more noise than this."""

COUNTS_FROM = 3000.0
"""Readings that are whole numbers and reach this size are probably counts of a converter."""

FORCE_ABOVE_N, TIMES_COVERED = 20.0, 9.81
"""A soft finger is pressed with a newton or two. A number above 20 is probably in gf, where it is a light touch. With
a calibration: a number that exceeds the largest calibrated force by this factor. A force in gf exceeds it by 102."""

SPEED_BELOW_MM_S = 0.5
"""A hand moves at 1 to 500 mm/s. If all speeds are smaller than this number, they are probably in m/s."""

MODULUS_ABOVE_MPA, DEPTH_ABOVE_MM = 20.0, 15.0
"""Specimens of silicone have 0.02 to 5 MPa; if all moduli are above 20 they are probably in kPa. No finger is pressed
in by 15 mm: such depths are probably in micrometres."""


class Sizes:
    """Collects, block by block, the largest magnitude of each column and whether readings are whole numbers.

    covered_N : largest force of the calibration, None without one.
    """

    def __init__(self, names: tuple[str, ...], gauges: int, covered_N: float | None = None):
        self._names, self._gauges = names, gauges
        self._force_above = FORCE_ABOVE_N if covered_N is None else TIMES_COVERED * covered_N
        self._largest, self._whole = np.zeros(len(names)), True

    def add(self, rows: np.ndarray) -> None:
        """Add rows (n, columns); NaN is ignored."""
        known = np.where(np.isfinite(rows), rows, 0.0)
        self._largest = np.maximum(self._largest, np.abs(known).max(axis=0, initial=0))
        self._whole &= bool((known[:, : self._gauges] % 1 == 0).all())

    def remarks(self, called: Mapping[str, str]) -> Iterator[str]:
        """Columns that seem to have another unit, each with the line of a map that states it; called : the
        log's own names of columns, if they differ."""
        gauges = self._largest[: self._gauges].max(initial=0)
        if 0 < gauges < STRAIN_BELOW:
            yield f"no reading is above {gauges:.2g}: this looks like strain, not microstrain" + _mend(
                "g1", "strain", called
            )
        elif self._whole and gauges >= COUNTS_FROM:
            yield f"readings are whole numbers up to {gauges:.0f}: this looks like counts" + _mend(
                "g1", "counts", called
            )
        for name, largest in zip(self._names[self._gauges :], self._largest[self._gauges :], strict=True):
            if name in ("force_N", "tangential_N") and largest > self._force_above:
                yield f"{name} comes to {largest:.3g}: this looks like gf" + _mend(name, "gf", called)
            if name == "velocity_mm_s" and 0 < largest < SPEED_BELOW_MM_S:
                yield f"velocity_mm_s stays below {largest:.2g}: this looks like m/s" + _mend(name, "m/s", called)


def of_presses(
    readings: np.ndarray,
    force_N: np.ndarray,
    modulus_MPa: np.ndarray,
    indentation_mm: np.ndarray | None,
    called: Mapping[str, str],
) -> Iterator[str]:
    """The same remarks on presses: readings (n, g), and what they were made with (n,)."""
    sizes = Sizes((*(f"g{number + 1}" for number in range(readings.shape[1])), "force_N"), readings.shape[1])
    sizes.add(np.column_stack([readings, force_N]))
    yield from sizes.remarks(called)
    if modulus_MPa.min() > MODULUS_ABOVE_MPA:
        yield f"no modulus_MPa is below {modulus_MPa.min():.3g}: this looks like kPa" + _mend(
            "modulus_MPa", "kPa", called
        )
    if indentation_mm is not None and indentation_mm.max() > DEPTH_ABOVE_MM:
        deepest = f"indentation_mm comes to {indentation_mm.max():.3g}"
        yield f"{deepest}: this looks like micrometres" + _mend("indentation_mm", "um", called)


def _mend(column: str, unit: str, called: Mapping[str, str]) -> str:
    return f' (if so: --map with {column} = {{ column = "{called.get(column, column)}", unit = "{unit}" }})'
