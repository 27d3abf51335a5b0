/* Young's modulus of what a soft tactile finger presses on, from the spread of its gauges and the force.
 *
 * Made by papilla ${version} for: ${finger}
 *
 *   ln S_d = a + b x + c x^2 - ln(1 + exp(d + e x) / E),  x = ln(force)
 *
 * S_d: population standard deviation of the gauge readings, microstrain (papilla_sd). Force in N, modulus in MPa.
 * Fitted over ${force_low} to ${force_high} N and ${modulus_low} to ${modulus_high} MPa, where the modulus that it gives is
 * off by ${rms} rms and ${max} at most from the calibration it was made from; outside, the answer is NaN.
 * sigma_MPa takes in that error, mesh, large strain and friction (${doubt} of S_d), and the noise that is stated.
 */
#ifndef PAPILLA_SOFTNESS_H
#define PAPILLA_SOFTNESS_H

#include <float.h>
#include <math.h>

typedef ${real} papilla_real;

enum papilla_status {
    PAPILLA_OK = 0,
    PAPILLA_FORCE_OUTSIDE = 1, /* of the fitted forces */
    PAPILLA_NO_READING = 2,    /* S_d is not a positive number */
    PAPILLA_SOFTER = 3,        /* than the fitted moduli */
    PAPILLA_HARDER = 4         /* than the fitted moduli: from there S_d hardly depends on the modulus */
};

/* Modulus in MPa, its standard deviation and 95 % interval: NaN where the status is not PAPILLA_OK. */
typedef struct {
    enum papilla_status status;
    papilla_real modulus_MPa, sigma_MPa, lower_MPa, upper_MPa;
} papilla_answer;

static const papilla_real PAPILLA_COEFFICIENTS[5] = { ${coefficients} };
static const papilla_real PAPILLA_FORCE_N[2] = { ${force_N} };
static const papilla_real PAPILLA_MODULUS_MPA[2] = { ${modulus_MPa} };
static const papilla_real PAPILLA_RMS = ${exact_rms};
static const papilla_real PAPILLA_DOUBT = ${exact_doubt};

/* Population standard deviation of n readings, in their unit. */
static inline papilla_real papilla_sd(const papilla_real *readings, int n)
{
    papilla_real mean = 0, square = 0;
    int i;
    for (i = 0; i < n; i++) mean += readings[i];
    mean /= (papilla_real)n;
    for (i = 0; i < n; i++) square += (readings[i] - mean) * (readings[i] - mean);
    return sqrt${f}(square / (papilla_real)n);
}

/* What is pressed. sd_sigma, force_sigma: standard deviations of the two inputs, 0 where they are exact. */
static inline papilla_answer papilla_softness(papilla_real sd_microstrain, papilla_real force_N,
                                              papilla_real sd_sigma, papilla_real force_sigma)
{
    const papilla_real *k = PAPILLA_COEFFICIENTS;
    papilla_real x, room, modulus, along_modulus, along_force, noise, relative;
    papilla_answer answer;
    answer.status = PAPILLA_OK;
    answer.modulus_MPa = answer.sigma_MPa = answer.lower_MPa = answer.upper_MPa = NAN;
    if (!(force_N >= PAPILLA_FORCE_N[0] && force_N <= PAPILLA_FORCE_N[1])) {
        answer.status = PAPILLA_FORCE_OUTSIDE;
        return answer;
    }
    if (!(sd_microstrain > 0 && sd_microstrain <= ${largest})) {
        answer.status = PAPILLA_NO_READING;
        return answer;
    }
    x = log${f}(force_N);
    room = exp${f}(k[0] + (k[1] + k[2] * x) * x) / sd_microstrain - 1;
    if (!(room > 0)) {
        answer.status = PAPILLA_HARDER;
        return answer;
    }
    modulus = exp${f}(k[3] + k[4] * x) / room;
    if (!(modulus >= PAPILLA_MODULUS_MPA[0] && modulus <= PAPILLA_MODULUS_MPA[1])) {
        answer.status = modulus < PAPILLA_MODULUS_MPA[0] ? PAPILLA_SOFTER : PAPILLA_HARDER;
        return answer;
    }
    along_modulus = room / (1 + room);
    along_force = k[1] + 2 * k[2] * x - k[4] * along_modulus;
    sd_sigma /= sd_microstrain;
    force_sigma *= along_force / force_N;
    noise = sqrt${f}(PAPILLA_DOUBT * PAPILLA_DOUBT + sd_sigma * sd_sigma + force_sigma * force_sigma) / along_modulus;
    relative = sqrt${f}(PAPILLA_RMS * PAPILLA_RMS + noise * noise);
    answer.modulus_MPa = modulus;
    answer.sigma_MPa = modulus * relative;
    answer.lower_MPa = modulus * exp${f}(-(${normal} * relative));
    answer.upper_MPa = modulus * exp${f}(${normal} * relative);
    return answer;
}

/* The modulus alone, NaN where the status is not PAPILLA_OK; *sigma_MPa (may be NULL) gets its standard deviation. */
static inline papilla_real papilla_modulus_MPa(papilla_real sd_microstrain, papilla_real force_N,
                                               papilla_real sd_sigma, papilla_real force_sigma,
                                               papilla_real *sigma_MPa)
{
    papilla_answer answer = papilla_softness(sd_microstrain, force_N, sd_sigma, force_sigma);
    if (sigma_MPa) *sigma_MPa = answer.sigma_MPa;
    return answer.modulus_MPa;
}

#endif
