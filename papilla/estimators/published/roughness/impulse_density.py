"""Impulse density of a model Meissner corpuscle (2006 paper, equations (1)-(4)), and its correction."""

from papilla.estimators.published.roughness.counting import ImpulseCount
from papilla.estimators.published.roughness.impulses import Corpuscle, ImpulseMethod, ImpulseStream

IMPULSES_A_GROOVE = 2


class ImpulseDensity(ImpulseStream):
    """Streaming frequency and wavelength from the density of impulses; a sample is (reading, velocity_mm_s[, t_s]).

    As printed: x = |d reading / dt| (1); an impulse where x crosses h = 1.5 x its mean over 200 ms upward; c impulses
    in the last a = 200 ms (2); f = c / (2 a) (3), two impulses a groove; wavelength = |v(t)| / f (4).

    Corrected: h = 1.2 x the mean; no second impulse before x has been below 0.8 h; and c is paired with the distance
    travelled while it was counted, wavelength = 2 distance / c, instead of with the velocity at the end.

    Measured (RMS error of the wavelength over 0.6-3.0 mm, synthetic gratings, as printed / corrected): 52 / 2.2 % at
    40 dB and 97-103 mm/s, where the printed threshold misses every other impulse of 0.6 mm and reads 1.75-2.0 times
    the wavelength; 51 / 19 % at 20 dB, because noise makes impulses and both read short; in active touch at 20 dB
    73 / 55 % (100 sin 2 pi t mm/s) and 115 / 70 % (197 sin 2 pi 1.07 t).

    Parameters are those of `RoughnessStream`; window_s (None: 0.2 s) is a, and the period of the mean.
    """

    VARIANTS = {
        "as_printed": ImpulseMethod(window_s=0.2, threshold=Corpuscle.PRINTED, paired=False),
        "corrected": ImpulseMethod(window_s=0.2, threshold=Corpuscle.CORRECTED, paired=True),
    }

    def _begin(self):
        a, method = self.window_samples, self._method
        count = ImpulseCount(a, self.sample_rate_Hz, IMPULSES_A_GROOVE, method.paired, self._fastest)
        return Corpuscle(a, method.threshold), count
