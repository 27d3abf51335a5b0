"""A C header that evaluates the compact inverse and its sigma: no library but math.h, no state, no allocation."""

from papilla.calibrate.compact_fit import fit_compact
from papilla.calibration import Calibration
from papilla.calibration.compact import Compact

HEADER = """\
/* Young's modulus of what a soft tactile finger presses on, from the spread of its gauges and the force.
 *
 * Made by papilla {version} for: {finger}
 *
 *   ln S_d = a + b x + c x^2 - ln(1 + exp(d + e x) / E),  x = ln(force)
 *
 * S_d: population standard deviation of the gauge readings, microstrain (papilla_sd). Force in N, modulus in MPa.
 * Fitted over {force_low:.4g} to {force_high:.4g} N and {low:.4g} to {high:.4g} MPa, where the modulus that it gives is
 * off by {rms:.1%} rms and {max:.1%} at most from the calibration it was made from; outside, the answer is NaN.
 * sigma_MPa takes in that error, mesh, large strain and friction ({doubt:.2%} of S_d), and the noise that is stated.
 */
#ifndef PAPILLA_SOFTNESS_H
#define PAPILLA_SOFTNESS_H

#include <math.h>

static const double PAPILLA_COEFFICIENTS[5] = {{ {coefficients} }};
static const double PAPILLA_FORCE_N[2] = {{ {force} }};
static const double PAPILLA_MODULUS_MPA[2] = {{ {modulus} }};
static const double PAPILLA_RMS = {rms_exact};
static const double PAPILLA_DOUBT = {doubt_exact};

/* Population standard deviation of n readings, in their unit. */
static inline double papilla_sd(const double *readings, int n)
{{
    double mean = 0.0, square = 0.0;
    int i;
    for (i = 0; i < n; i++) mean += readings[i];
    mean /= n;
    for (i = 0; i < n; i++) square += (readings[i] - mean) * (readings[i] - mean);
    return sqrt(square / n);
}}

/* Modulus in MPa, or NaN outside the fitted ranges; *sigma_MPa (may be NULL) gets its standard deviation.
 * sd_sigma, force_sigma: standard deviations of the two inputs, 0 where they are exact. */
static inline double papilla_modulus_MPa(double sd_microstrain, double force_N, double sd_sigma, double force_sigma,
                                  double *sigma_MPa)
{{
    const double *k = PAPILLA_COEFFICIENTS;
    double x, room, spring, modulus, along_modulus, along_force, noise;
    if (sigma_MPa) *sigma_MPa = NAN;
    if (!(force_N >= PAPILLA_FORCE_N[0] && force_N <= PAPILLA_FORCE_N[1])) return NAN;
    if (!(sd_microstrain > 0.0) || isinf(sd_microstrain)) return NAN;
    x = log(force_N);
    room = exp(k[0] + (k[1] + k[2] * x) * x) / sd_microstrain - 1.0;
    spring = exp(k[3] + k[4] * x);
    if (!(room > 0.0)) return NAN;
    modulus = spring / room;
    if (!(modulus >= PAPILLA_MODULUS_MPA[0] && modulus <= PAPILLA_MODULUS_MPA[1])) return NAN;
    along_modulus = room / (1.0 + room);
    along_force = k[1] + 2.0 * k[2] * x - k[4] * along_modulus;
    sd_sigma /= sd_microstrain;
    force_sigma *= along_force / force_N;
    noise = sqrt(PAPILLA_DOUBT * PAPILLA_DOUBT + sd_sigma * sd_sigma + force_sigma * force_sigma) / along_modulus;
    if (sigma_MPa) *sigma_MPa = modulus * sqrt(PAPILLA_RMS * PAPILLA_RMS + noise * noise);
    return modulus;
}}

#endif
"""


def c_header(calibration: Calibration) -> str:
    """The header (C99) of a calibration's compact form, which is fitted now where the calibration has none.

    Its answers are those of `Compact.invert` to 1e-9 of them (a compiled test holds it to that). Raises `InputError`
    where the form does not fit the calibration.
    """
    from papilla import __version__

    form: Compact = calibration.compact or fit_compact(calibration)
    name = str(calibration.finger.get("name") or "a measured finger")
    # A name could end the comment or the line
    plain = "".join(sign if sign.isprintable() and sign not in "*/\\" else " " for sign in name)
    return HEADER.format(
        version=__version__,
        finger=plain,
        force_low=form.force_N[0],
        force_high=form.force_N[1],
        low=form.modulus_MPa[0],
        high=form.modulus_MPa[1],
        rms=form.rms,
        max=form.max,
        doubt=form.doubt,
        coefficients=_list(form.coefficients),
        force=_list(form.force_N),
        modulus=_list(form.modulus_MPa),
        rms_exact=_exact(form.rms),
        doubt_exact=_exact(form.doubt),
    )


def _exact(value: float) -> str:
    """A number that C reads back bit for bit."""
    return f"{float(value):.17g}" if "." in f"{float(value):.17g}" else f"{float(value):.17g}.0"


def _list(values) -> str:
    return ", ".join(_exact(value) for value in values)
