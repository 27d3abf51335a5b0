"""Frequency from the interval between two impulses (2006 paper, equation (5)), and its correction."""

from dataclasses import dataclass, field

from papilla.estimators.published.roughness.answer import ALIASED, NONE, OK, SILENT, Finding
from papilla.estimators.published.roughness.impulses import Corpuscle, ImpulseMethod, ImpulseStream


class ImpulseInterval(ImpulseStream):
    """Streaming frequency from single intervals; a sample is (reading, velocity_mm_s[, t_s]).

    As printed: f_t = 1 / t_v (5), t_v the time between the last two impulses of the corpuscle (threshold 1.5 x the
    mean slope over 200 ms). Entering a groove and reaching a ridge both emit one, so (5) read literally is about
    twice v / wavelength, and flickers where the two edges are not half a wavelength apart.

    Corrected: threshold and hysteresis of `ImpulseDensity`'s correction; t_v between two impulses of the same edge
    (the reading rising at both, or falling); and the wavelength is the distance travelled in t_v.

    Measured (RMS error of the wavelength over 0.6-3.0 mm, synthetic gratings, as printed / corrected): 60 / 2.3 % at
    40 dB and 97-103 mm/s, 59 / 26 % at 20 dB, and 66 / 60 % in active touch of 100 sin 2 pi t mm/s at 20 dB.

    Parameters are those of `RoughnessStream`; window_s (None: 0.2 s) is the period of the mean slope, and an answer is
    held so long without a new impulse.
    """

    VARIANTS = {
        "as_printed": ImpulseMethod(window_s=0.2, threshold=Corpuscle.PRINTED, paired=False),
        "corrected": ImpulseMethod(window_s=0.2, threshold=Corpuscle.CORRECTED, paired=True),
    }

    def _begin(self):
        samples, method = self.window_samples, self._method
        interval = LastInterval(samples, self.sample_rate_Hz, method.paired, self._fastest)
        return Corpuscle(samples, method.threshold), interval


@dataclass(eq=False)
class LastInterval:
    """The interval between the last two impulses of any edge, or of the `same_edge`, if it is not older than `samples`.

    _since : samples and distance in mm since the last impulse of each edge (1 rising, -1 falling), if it is not older
    than that; _interval : the same between the last two impulses, 0 samples if there is none.
    """

    samples: int
    rate_Hz: float
    same_edge: bool
    fastest_mm_s: float
    _since: dict[float, tuple[int, float]] = field(default_factory=dict, init=False)
    _interval: tuple[int, float] = field(default=(0, NONE), init=False)

    def find(self, impulse: float, speed: float) -> Finding:
        """The finding after a sample: its impulse (1 rising, -1 falling, 0 none), and |velocity|."""
        moved = speed / self.rate_Hz
        # Impulses older than a window are forgotten, so the state does not grow with the stream.
        self._since = {edge: (age + 1, path + moved) for edge, (age, path) in self._since.items() if age < self.samples}
        if not self._since:
            self._interval = (0, NONE)
        if abs(impulse) > 0:
            latest = min(self._since.values(), default=self._interval)
            self._interval = self._since.get(impulse, self._interval) if self.same_edge else latest
            self._since[impulse] = (0, 0.0)
        samples, distance = self._interval
        if not samples:
            return Finding(SILENT)
        if speed > self.fastest_mm_s or samples <= 2:
            return Finding(ALIASED)
        return Finding(OK, self.rate_Hz / samples, distance if self.same_edge else moved * samples)
