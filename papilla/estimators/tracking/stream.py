"""What the small trackers share: blocks from samples, velocity into distance, a state that is a frozen dataclass."""

import math
from abc import ABC, abstractmethod

import numpy as np

from papilla.errors import InputError
from papilla.estimators.tracking.answer import WavelengthEstimate

VAGUE = 0.05
"""Sigma, as a fraction of the wavelength, from which an answer is a guess."""


class WavelengthStream(ABC):
    """Base of trackers whose state is one frozen dataclass in `self.state`; they define `_fresh()` and `update`."""

    def reset(self) -> None:
        """Forget everything."""
        self.state = self._fresh()

    @abstractmethod
    def _fresh(self):
        """The state of an estimator that knows nothing."""

    @abstractmethod
    def update(self, sample) -> WavelengthEstimate:
        """The estimate after one more sample (reading, velocity_mm_s); raises `InputError` for another length."""

    def process(self, block) -> WavelengthEstimate:
        """Estimates after each row of a block (n, 2); bit for bit what `update` gives row by row.

        Raises `InputError` for a block of another shape.
        """
        rows = np.asarray(block, float)
        if rows.ndim != 2 or rows.shape[1] != 2:
            raise InputError(f"a block must be n x 2 (reading, velocity_mm_s), got {' x '.join(map(str, rows.shape))}")
        answers = [self.update(row) for row in rows.tolist()]
        wavelength, sigma, frequency, status = zip(*answers, strict=True) if answers else ((), (), (), ())
        return WavelengthEstimate(
            np.array(wavelength, float), np.array(sigma, float), np.array(frequency, float), np.array(status, int)
        )


def pair(sample) -> tuple[float, float]:
    """The sample as (reading, velocity); raises `InputError` for another length."""
    if len(sample) != 2:
        raise InputError(f"a sample must be (reading, velocity_mm_s), got {len(sample)} values")
    return float(sample[0]), float(sample[1])


def frequency_of(velocity: float, wavelength: float) -> float:
    """|velocity| over wavelength in Hz; NaN without a finite velocity."""
    return abs(velocity) / wavelength if math.isfinite(velocity) else math.nan
