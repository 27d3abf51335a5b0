"""Young's modulus by a regression of S_d, sample by sample: equation (10) of 2006 as printed, exact or refitted, or the
compact form."""

import math
from dataclasses import replace
from functools import partial
from typing import ClassVar, Literal, get_args

import numpy as np

from papilla.calibration import IDENTIFIABLE_SIGMA, Calibration, SoftnessStatus, published
from papilla.calibration.readouts import Compact, CompactStatus
from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.units import gf_to_newton, newton_to_gf
from papilla.estimators.health import STUCK_SAMPLES, GaugeHealth, HealthState, numbered
from papilla.estimators.softness import SoftnessEstimate
from papilla.estimators.stream import Stream

Form = Literal["printed", "exact", "quadratic", "compact"]
REGRESSION_FORMS: tuple[Form, ...] = get_args(Form)
BEYOND_HARDEST = 1.5
"""Largest modulus for which a regression of the three specimens is used, as a multiple of the hardest of them."""
COMPARED_GF = tuple(range(10, 101, 10))
"""Forces at which a calibration is compared with (9) to find the scale of its S_d."""


class PrintedSoftness(Stream):
    """Streaming modulus by the published form; one sample is (g1, ..., gg, force_N), readings in microstrain.

    E = sqrt(k0 S_d + k1 f^2 + k2 f + k3) - shift (2006, eq. (10)), f in gf, each sample by itself. Form "printed" has
    the printed coefficients, "exact" those of the exact inverse of (9), "quadratic" those refitted for the calibration.
    The unit of S_d is not printed: the first two use the calibration's S_d in microstrain times the factor that brings
    it closest to (9), unless `scale` gives it. "compact" is another regression of five coefficients, which fits
    presses (`papilla.calibration.readouts.Compact`), if the calibration contains it.

    Use `Softness` or `GaugeSoftness` for reliable values: the published form cannot fit the mechanics. On presses
    of the default finger the refitted one refuses many and misses the rest by tens of per cent (`papilla reproduce
    --only A40`). Sigma includes that misfit: the rms difference between the calibration's S_d and the form.

    Parameters
    ----------
    calibration : of the same gauges; None for the printed forms with a stated `scale` and `gauges`.
    gauge_sigma, force_sigma_N : noise of a gauge (microstrain) and of the force.
    scale : published S_d per microstrain. gauges : their number, where there is no calibration.
    contact_force_N : below it there is no contact. saturation, stuck_samples : see `Softness`.

    scale, misfit : published S_d per microstrain of this finger (1 for refitted forms); and the rms by which presses
    miss the form, in units of its S_d (relative for the compact form).

    Raises `InputError` for unusable values, for a refitted quadratic that nowhere rises with the modulus, and for a
    calibration without the compact form.
    """

    answer: ClassVar[type] = SoftnessEstimate
    note = "by the published form, which does not fit presses of a finger; sigma contains its misfit"

    def __init__(
        self,
        calibration: Calibration | None = None,
        *,
        form: Form = "printed",
        gauge_sigma: float = 0.0,
        force_sigma_N: float = 0.0,
        scale: float | None = None,
        gauges: int | None = None,
        contact_force_N: float = 0.02,
        saturation: float = math.inf,
        stuck_samples: int = STUCK_SAMPLES,
    ):
        if form not in REGRESSION_FORMS:
            raise InputError(f"form must be {', '.join(REGRESSION_FORMS[:-1])} or {REGRESSION_FORMS[-1]}, got {form!r}")
        refitted = form in ("quadratic", "compact")
        if calibration is None and (refitted or scale is None or gauges is None):
            raise InputError("without a calibration the form is printed or exact, and scale and gauges must be given")
        if refitted and scale is not None:
            raise InputError("scale is for the printed coefficients: refitted ones are of microstrain")
        self._gauges = len(calibration.gauges) if calibration is not None else int(gauges or 0)
        if self._gauges < 2 or (calibration is not None and gauges not in (None, self._gauges)):
            raise InputError(f"gauges must be at least 2 and as many as the calibration has, got {gauges}")
        self._noise = checks.within("gauge_sigma (microstrain)", gauge_sigma, 0, math.inf) / math.sqrt(self._gauges)
        self._force_sigma = float(newton_to_gf(checks.within("force_sigma_N", force_sigma_N, 0, math.inf)))
        self._contact = checks.positive("contact_force_N", contact_force_N)
        self._health = GaugeHealth(self._gauges, saturation, stuck_samples)
        self._memory, self.columns = self._health.fresh, (*numbered(self._gauges), "force_N")
        self._compact: Compact | None = None
        if refitted and calibration is not None:
            self._take_refitted(form, calibration)
        else:
            self._take_printed(form, calibration, scale)

    def _take_refitted(self, form: Form, calibration: Calibration) -> None:
        """Use a regression of the calibration; raises `InputError` if it has none, or one without an inverse."""
        if form == "compact":
            fitted = calibration.compact
            if fitted is None:
                raise InputError("the calibration has no compact form: its S_d does not follow it")
            # A specimen at the end of what was fitted scatters beyond it, where the form saturates as the physics does
            ends = (fitted.modulus_MPa[0] / BEYOND_HARDEST, BEYOND_HARDEST * fitted.modulus_MPa[1])
            self._compact = replace(fitted, modulus_MPa=ends)
            self.misfit = fitted.sd_rms
            force_N = fitted.force_N
        else:
            inverse, force_N = calibration.inverse, calibration.domain["force_N"]
            if inverse.modulus_MPa is None:
                raise InputError("the calibration's quadratic rises with the modulus nowhere, so it has no inverse")
            self._inverse, self._range, self.misfit = inverse, inverse.modulus_MPa, calibration.forward.rms
            self._forward = tuple(calibration.forward.coefficients.tolist())
        self.scale, self._force_gf = 1.0, (float(newton_to_gf(force_N[0])), float(newton_to_gf(force_N[1])))

    def _take_printed(self, form: Form, calibration: Calibration | None, scale: float | None) -> None:
        self._inverse = published.PUBLISHED_INVERSE if form == "printed" else published.exact_inverse()
        self._forward, self._force_gf = published.PUBLISHED_FORWARD, published.PUBLISHED_FORCE_GF
        # A refitted quadratic through three moduli only interpolates between them, and does not hold beyond.
        self._range = (0.5 * published.SPECIMENS_MPA[0], BEYOND_HARDEST * published.SPECIMENS_MPA[-1])
        self.scale, self.misfit = 1.0 if scale is None else checks.positive("scale", scale), 0.0
        if calibration is not None:
            ours, theirs, best = published.compare_with_published(calibration.predict, COMPARED_GF)
            self.scale = best if scale is None else self.scale
            self.misfit = float(np.sqrt(np.mean((self.scale * ours - theirs) ** 2)))

    def _remember(self, memory: HealthState) -> None:
        self._health.fits(memory)
        self._memory = memory

    def _fresh(self) -> HealthState:
        return self._health.fresh

    def _take(self, sample: tuple[float, ...]) -> SoftnessEstimate:
        readings, force_N = sample[:-1], sample[-1]
        faults, self._memory = self._health.check(readings, self._memory)
        return self.feel(readings, force_N, faults)

    def feel(self, readings: tuple[float, ...], force_N: float, found: tuple[int, ...]) -> SoftnessEstimate:
        """The estimate after one more sample; found : its gauges' faults, as `GaugeHealth.check` finds them."""
        force, (low, high) = float(newton_to_gf(force_N)), self._force_gf
        if not math.isfinite(force_N):
            status = SoftnessStatus.BAD_INPUT
        elif force_N < self._contact:
            status = SoftnessStatus.NO_CONTACT
        elif found:
            status = SoftnessStatus.BAD_GAUGE
        elif not low * (1 - checks.ROUNDING_SHARE) <= force <= high * (1 + checks.ROUNDING_SHARE):
            status = SoftnessStatus.FORCE_BELOW if force < low else SoftnessStatus.FORCE_ABOVE
        else:
            mean = math.fsum(readings) / self._gauges
            sd = self.scale * math.sqrt(math.fsum((value - mean) ** 2 for value in readings) / self._gauges)
            evaluated = self._by_quadratic if self._compact is None else self._by_compact
            modulus, sigma, status = evaluated(sd, force)
            if math.isfinite(modulus):
                identifiable = modulus > 0 and sigma <= IDENTIFIABLE_SIGMA * modulus
                status = SoftnessStatus.OK if identifiable else SoftnessStatus.NOT_IDENTIFIABLE
            return SoftnessEstimate(modulus, sigma, int(status))
        return SoftnessEstimate(status=int(status))

    def _by_compact(self, sd: float, force: float) -> tuple[float, float, SoftnessStatus]:
        """Modulus and sigma behind S_d (microstrain) by the compact form, at a force in gf; NaN, NaN and the side."""
        form = self._compact
        assert form is not None
        inside = min(max(gf_to_newton(force), form.force_N[0]), form.force_N[1])
        answer = form.answer(sd, inside, self._noise, gf_to_newton(self._force_sigma))
        side = SoftnessStatus.HARDER if answer.status == CompactStatus.HARDER else SoftnessStatus.SOFTER
        return answer.modulus_MPa, answer.sigma_MPa, side

    def _by_quadratic(self, sd: float, force: float) -> tuple[float, float, SoftnessStatus]:
        """Modulus and sigma behind S_d, in units of the form, at a force in gf; NaN, NaN and the side."""
        per_sd, per_f2, per_f, constant = map(float, self._inverse.coefficients)
        square = per_sd * sd + (per_f2 * force + per_f) * force + constant
        low, high = self._range
        modulus = self._inverse.branch * math.sqrt(square) - self._inverse.shift if square >= 0 else math.nan
        if not low <= modulus <= high:
            softest = float(published.quadratic(self._forward, force, low))
            return math.nan, math.nan, SoftnessStatus.SOFTER if sd < softest else SoftnessStatus.HARDER
        # dE = (k0 dS_d + (2 k1 f + k2) df) / (2 sqrt(...)), plus the misfit of S_d to the form
        root = max(math.sqrt(square), 1e-12)
        along_sd, along_force = per_sd / (2 * root), (2 * per_f2 * force + per_f) / (2 * root)
        sigma = math.hypot(along_sd * self.scale * self._noise, along_force * self._force_sigma, along_sd * self.misfit)
        return modulus, sigma, SoftnessStatus.OK


printed, exact, quadratic, compact = (partial(PrintedSoftness, form=form) for form in REGRESSION_FORMS)
"""The forms as methods of softness, which a pipeline finds by their entry points."""
