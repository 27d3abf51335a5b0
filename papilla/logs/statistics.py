"""Statistics of columns that arrive block by block, in bounded memory: median, white noise, numbers whose size suggests
another unit (strain, counts, gram-force, m/s), and the lowest and highest rows for a picture."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

EXACT_NUMBERS, KEPT_SHIFT = 2**19, 38
"""Up to `EXACT_NUMBERS` numbers (4 MB a column) are stored exactly. Beyond that, numbers whose floats differ only in
the last `KEPT_SHIFT` bits form a group."""

STRAIN_BELOW = 0.05
"""Microstrain. A log whose readings are all smaller is probably in strain: gauges have more noise than this."""

SUSPECTED_COUNTS_FROM = 3000.0
"""Readings that are whole numbers and reach this size are probably counts of a converter."""

FORCE_ABOVE_N, TIMES_COVERED = 20.0, 9.81
"""A soft finger is pressed with a newton or two. A number above 20 is probably in gf, where it is a light touch. With
a calibration: a number that exceeds the largest calibrated force by this factor. A force in gf exceeds it by 102."""

SPEED_BELOW_MM_S = 0.5
"""A hand moves at 1 to 500 mm/s. If all speeds are smaller than this number, they are probably in m/s."""

MODULUS_ABOVE_MPA, DEPTH_ABOVE_MM = 20.0, 15.0
"""Specimens of silicone have 0.02 to 5 MPa; if all moduli are above 20 they are probably in kPa. No finger is pressed
in by 15 mm: such depths are probably in micrometres."""

THINNED_BINS = 1000
"""Number of bins of a thinned log (up to twice as many): more than a picture has pixels."""


class Magnitudes:
    """Numbers >= 0 in bounded memory: the first `kept` exactly, more of them in groups 1 part in 10,000 wide."""

    def __init__(self, kept: int = EXACT_NUMBERS) -> None:
        self._kept = kept
        self._grouped, self._counts = np.empty(0), np.empty(0)
        self._new: list[np.ndarray] = []

    def add(self, values: np.ndarray) -> None:
        """Add values (n,)."""
        self._new.append(values)
        if len(self._grouped) + sum(map(len, self._new)) > self._kept:
            values, counts = self._all()
            _, group = np.unique(values.view(np.uint64) >> np.uint64(KEPT_SHIFT), return_inverse=True)
            self._counts = np.bincount(group, counts).astype(float)
            self._grouped, self._new = np.bincount(group, counts * values) / self._counts, []

    def median(self) -> float:
        """The median; NaN if there are no values."""
        values, counts = self._all()
        if not values.size:
            return float("nan")
        order = np.argsort(values)
        reached = np.cumsum(counts[order])
        middle = np.searchsorted(reached, [(reached[-1] - 1) // 2, reached[-1] // 2], side="right")
        return float(values[order[middle]].mean())

    def split(self, limit: float) -> tuple[float, int]:
        """Mean of the values up to the limit, and number of those above it."""
        values, counts = self._all()
        below = values <= limit
        return float(np.average(values[below], weights=counts[below])), int(counts[~below].sum())

    def _all(self) -> tuple[np.ndarray, np.ndarray]:
        """Values and the number of times that each counts."""
        new = np.concatenate([*self._new, np.empty(0)])
        return np.concatenate([self._grouped, new]), np.concatenate([self._counts, np.ones(len(new))])


def white_noise(samples: np.ndarray | Sequence[float]) -> float:
    """Standard deviation of the white noise in evenly spaced samples (n,); NaN for fewer than three finite ones.

    sigma = median |second difference| / (0.6745 sqrt(6)): 0.6745 is the median of |N(0, 1)|, and the second difference
    of white noise has 6 times its variance. A ramp does not change the median, and a few steps change it little.
    """
    noise = WhiteNoise()
    noise.add(np.asarray(samples, float)[:, None])
    return noise.sigma[0]


class WhiteNoise:
    """Standard deviation of the white noise of columns that arrive block by block."""

    def __init__(self) -> None:
        self._before: np.ndarray | None = None
        self._columns: list[Magnitudes] = []

    def add(self, rows: np.ndarray) -> None:
        """Add the next rows (n, columns)."""
        joined = rows if self._before is None else np.concatenate([self._before, rows])
        self._columns = self._columns or [Magnitudes() for _ in rows.T]
        with np.errstate(invalid="ignore", over="ignore"):
            second = np.abs(np.diff(joined, n=2, axis=0))
        for column, values in zip(self._columns, second.T, strict=True):
            column.add(values[np.isfinite(values)])
        self._before = joined[-2:]

    @property
    def sigma(self) -> list[float]:
        """Standard deviation of the white noise of each column; NaN if it cannot be estimated."""
        return [column.median() / (0.6744897501960817 * np.sqrt(6)) for column in self._columns]


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
        finite = np.where(np.isfinite(rows), rows, 0.0)
        self._largest = np.maximum(self._largest, np.abs(finite).max(axis=0, initial=0))
        self._whole &= bool((finite[:, : self._gauges] % 1 == 0).all())

    def notes(self, called: Mapping[str, str]) -> Iterator[str]:
        """Columns that seem to have another unit, each with the line of a map that states it; called : the
        log's own names of columns, if they differ."""
        gauges = self._largest[: self._gauges].max(initial=0)
        if 0 < gauges < STRAIN_BELOW:
            yield _note(f"no reading is above {gauges:.2g}", "strain, not microstrain", "g1", "strain", called)
        elif self._whole and gauges >= SUSPECTED_COUNTS_FROM:
            yield _note(f"readings are whole numbers up to {gauges:.0f}", "counts", "g1", "counts", called)
        for name, largest in zip(self._names[self._gauges :], self._largest[self._gauges :], strict=True):
            if name in ("force_N", "tangential_N") and largest > self._force_above:
                yield _note(f"{name} comes to {largest:.3g}", "gf", name, "gf", called)
            if name == "velocity_mm_s" and 0 < largest < SPEED_BELOW_MM_S:
                yield _note(f"velocity_mm_s stays below {largest:.2g}", "m/s", name, "m/s", called)


def of_presses(
    readings: np.ndarray,
    force_N: np.ndarray,
    modulus_MPa: np.ndarray,
    indentation_mm: np.ndarray | None,
    called: Mapping[str, str],
) -> Iterator[str]:
    """The same notes on presses: readings (n, g), and what they were made with (n,)."""
    sizes = Sizes((*(f"g{number + 1}" for number in range(readings.shape[1])), "force_N"), readings.shape[1])
    sizes.add(np.column_stack([readings, force_N]))
    yield from sizes.notes(called)
    if (least := modulus_MPa.min()) > MODULUS_ABOVE_MPA:
        yield _note(f"no modulus_MPa is below {least:.3g}", "kPa", "modulus_MPa", "kPa", called)
    if indentation_mm is not None and (deepest := indentation_mm.max()) > DEPTH_ABOVE_MM:
        yield _note(f"indentation_mm comes to {deepest:.3g}", "micrometres", "indentation_mm", "um", called)


def _note(what: str, looks: str, column: str, unit: str, called: Mapping[str, str]) -> str:
    mend = f'{column} = {{ column = "{called.get(column, column)}", unit = "{unit}" }}'
    return f"{what}: this looks like {looks} (if so: --map with {mend})"


class Thinned:
    """Lowest and highest value (bins, columns) of rows that arrive block by block; NaN only if a bin has no number.

    Bins are of equally many rows, the last few excepted. Whenever there are twice `bins`, neighbours are joined.
    """

    def __init__(self, bins: int = THINNED_BINS) -> None:
        self._most = 2 * bins
        self._every = 1
        self._low: list[np.ndarray] = []
        self._high: list[np.ndarray] = []
        self._bins = 0

    def add(self, rows: np.ndarray) -> None:
        """Add the next rows (n, columns)."""
        if not len(rows):
            return
        starts = np.arange(0, len(rows), self._every)
        self._low.append(np.fmin.reduceat(rows, starts, axis=0))
        self._high.append(np.fmax.reduceat(rows, starts, axis=0))
        self._bins += len(starts)
        while self._bins >= self._most:
            pairs = np.arange(0, self._bins, 2)
            self._low = [np.fmin.reduceat(np.concatenate(self._low), pairs, axis=0)]
            self._high = [np.fmax.reduceat(np.concatenate(self._high), pairs, axis=0)]
            self._bins, self._every = len(pairs), 2 * self._every

    @property
    def low(self) -> np.ndarray:
        """(bins, columns) lowest values."""
        return np.concatenate(self._low)

    @property
    def high(self) -> np.ndarray:
        """(bins, columns) highest values."""
        return np.concatenate(self._high)
