"""Zero crossings of the high-passed signal accumulated over a period A (2007 paper), and its correction."""

from typing import Any

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.published.roughness.counting import ImpulseCount
from papilla.estimators.published.roughness.impulses import ImpulseMethod, ImpulseStream, UpwardCrossings


class ZeroCrossing(ImpulseStream):
    """Streaming frequency and wavelength from zero crossings; a sample is (reading, velocity_mm_s[, t_s]).

    As printed: an impulse each time the high-passed reading goes over zero, one a period; f = impulses in the last
    A = 0.08 s / A; wavelength = |v(t)| / f. `expected_error` says for which touch 0.08 s is best. The paper states
    neither order nor corner of the high-pass: first order, 10 Hz, is assumed. It must lie below |v| / wavelength.

    Corrected: a crossing counts only after the signal has been below -0.7 x its mean size over A, and the count is
    paired with the distance travelled in A.

    Measured (RMS error of the wavelength over 0.6-3.0 mm, synthetic gratings, as printed / corrected): 13 / 13 % at
    20 dB and 97-103 mm/s, which is the counting of whole periods; 59 / 46 % at 0 dB; at 20 dB 40 / 21 % in active touch
    of 100 sin 2 pi t mm/s and 40 / 13 % of 197 sin 2 pi 1.07 t.

    Parameters are those of `RoughnessStream`, where window_s (None: 0.08 s) is A, and high_pass_Hz : corner frequency,
    < sample_rate_Hz / 2. Raises `InputError` for unusable values.
    """

    VARIANTS = {
        "as_printed": ImpulseMethod(window_s=0.08, threshold=UpwardCrossings.PRINTED, paired=False),
        "corrected": ImpulseMethod(window_s=0.08, threshold=UpwardCrossings.CORRECTED, paired=True),
    }

    def __init__(self, *, high_pass_Hz: float = 10.0, **parameters: Any):
        self._corner = checks.positive("high_pass_Hz", high_pass_Hz)
        super().__init__(**parameters)

    def _prepare(self):
        if not self._corner < 0.5 * self.sample_rate_Hz:
            raise InputError(f"high_pass_Hz must be below half of sample_rate_Hz, got {self._corner:g}")
        self._settings += f", high-pass of {self._corner:g} Hz"

    def _begin(self):
        a, rate, method = self.window_samples, self.sample_rate_Hz, self._method
        crossings = UpwardCrossings(a, method.threshold, rate, self._corner)
        return crossings, ImpulseCount(a, rate, 1, method.paired, self._fastest)
