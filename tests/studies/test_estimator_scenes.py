"""The scenes, their Cramér-Rao bound, and the measures of the comparison."""

import math

import numpy as np
import pytest

from papilla.errors import InputError
from papilla.references.cramer_rao import frequency_bound, wavelength_bound
from papilla.studies.estimator_bench import measures
from papilla.studies.estimator_bench.competitors import COMPETITORS, chosen
from papilla.studies.estimator_bench.likelihood import fit_wavelengths, likelihood
from papilla.studies.estimator_bench.plan import Plan
from papilla.studies.estimator_bench.scenes import HARMONICS, SCENES, WAVELENGTHS_MM, profile_amplitudes, scene, sheared


@pytest.mark.parametrize("name", SCENES)
def test_position_is_the_integral_of_velocity(name):
    made = scene(name, 1.8, seed=3)
    steps = 0.5 * (made.velocity_mm_s[1:] + made.velocity_mm_s[:-1]) / made.sample_rate_Hz
    assert np.cumsum(steps) == pytest.approx(made.position_mm[1:] - made.position_mm[0], abs=1e-3)


@pytest.mark.parametrize("wavelength", WAVELENGTHS_MM)
def test_the_profile_has_unit_power_and_is_the_felt_trapezoid(wavelength):
    amplitudes = profile_amplitudes(wavelength)
    assert np.sum(np.abs(amplitudes) ** 2) / 2 == pytest.approx(1)
    x = np.arange(4096) / 4096
    trapezoid = np.interp(x, [0, 0.08, 0.5, 0.65, 1], [0, 1, 1, 0, 0])
    spectrum = np.fft.rfft(trapezoid)[1:10] / 2048
    spectrum *= np.exp(-0.5 * (2 * math.pi * np.arange(1, 10) * 0.1 / wavelength) ** 2)
    spectrum *= math.sqrt(2 / np.sum(np.abs(spectrum) ** 2))
    assert np.abs(spectrum) == pytest.approx(np.abs(amplitudes), abs=1e-4)


def test_snr_and_seed():
    quiet, same, other = (scene("const", 1.2, snr_dB=10, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(quiet.readings, same.readings)
    assert not np.array_equal(quiet.readings, other.readings)
    assert np.var(quiet.readings - quiet.signal) == pytest.approx(0.1, rel=0.1)


def test_gauges_see_the_same_grating_at_their_places():
    made = scene("const", 2.4, seed=1, gauge_positions_mm=(0, 2.4, 1.2))
    assert made.signal[:, 0] == pytest.approx(made.signal[:, 1], abs=1e-9)
    assert np.corrcoef(made.signal[:, 0], made.signal[:, 2])[0, 1] < -0.8


def test_the_harsh_skin_trails_the_finger():
    """The skin is 0.3 mm behind on the way out and 0.3 mm ahead (still behind its motion) on the way back."""
    out = np.linspace(0, 10, 500)
    skin = sheared(np.concatenate([out, out[::-1]]))
    assert skin[499] - 10 == pytest.approx(-0.3)
    assert skin[-1] == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize(
    "window, expected", [(0.08, (0.134, 0.18, 0.088)), (0.2, (0.033, 0.051, 0.025)), (0.5, (0.0083, 0.015, 0.0077))]
)
def test_the_bound_is_that_of_the_first_computation(window, expected):
    for name, percent in zip(("const", "act1", "act2"), expected, strict=True):
        bounds = [scene(name, wavelength).bound(window, 0.05) for wavelength in WAVELENGTHS_MM]
        assert 100 * math.sqrt(np.mean(np.square(bounds))) == pytest.approx(percent, rel=0.2)


def test_the_bound_scales_with_noise_and_is_infinite_without_motion():
    position = np.linspace(0, 10, 200)
    quiet = wavelength_bound(position, 2.0, [1, 0.3j], 0.1)
    assert wavelength_bound(position, 2.0, [1, 0.3j], 0.2) == pytest.approx(2 * quiet)
    assert wavelength_bound(np.zeros(200), 2.0, [1, 0.3j], 0.1) == math.inf
    assert wavelength_bound(10 * position, 20.0, [1, 0.3j], 0.1) == pytest.approx(quiet)


@pytest.mark.parametrize("kind", ["const", "act1", "act2"])
def test_a_maximum_likelihood_fit_reaches_the_bound(kind):
    """Its scatter over 2 x 150 noises is the bound within 4 standard errors, 1 / sqrt(2 x 300) each."""
    found = likelihood(kind, (1.2, 3.0), draws=150, seed=5)
    assert found.ratio == pytest.approx(1, abs=4 / math.sqrt(2 * found.fits))


def test_the_likelihood_fit_is_exact_without_noise():
    made = scene("act2", 1.8, seed=1)
    rows = slice(1900, 2100)
    present = made.frequency_Hz[rows, None] * np.arange(1, HARMONICS + 1) < 400
    found = fit_wavelengths(made.position_mm[rows], made.signal[rows], present, 1.7)
    assert found == pytest.approx([1.8], rel=1e-9)


def test_the_bound_is_that_of_the_signal_s_own_derivative():
    """Information from finite differences of the scene's signal, which knows nothing of the bound's harmonics."""
    step, rows = 1e-5, slice(1000, 1200)
    made = scene("const", 1.8, seed=2)
    at = made.position_mm[rows] - made.position_mm[rows].mean()
    order = np.arange(1, HARMONICS + 1)
    present = made.frequency_Hz[rows, None] * order < 400

    def signal(wavelength):
        waves = np.exp(-2j * math.pi * at[:, None] * order / wavelength) * present
        return waves, np.real(waves @ profile_amplitudes(1.8))

    waves = signal(1.8)[0][:, present.all(axis=0)]
    slope = (signal(1.8 + step)[1] - signal(1.8 - step)[1]) / (2 * step)
    others = np.column_stack([waves.real, waves.imag, np.ones(at.size)])
    rest = slope - others @ np.linalg.lstsq(others, slope, rcond=None)[0]
    expected = made.noise_sd / np.linalg.norm(rest) / 1.8
    assert wavelength_bound(at, 1.8, profile_amplitudes(1.8), made.noise_sd, present) == pytest.approx(
        expected, rel=1e-6
    )


def test_several_gauges_share_the_bound():
    one, four = (scene("const", 1.8, seed=1, gauge_positions_mm=(0.0, 2.0, 5.0, 9.0)[:count]) for count in (1, 4))
    assert four.bound(0.2) == pytest.approx(one.bound(0.2) / 2)


def test_the_bound_of_a_blind_frequency():
    """One harmonic of constant frequency, middle of the window: the textbook 12 / (2 pi)^2 ... of Rife and Boorstyn."""
    count, rate, frequency = 1000, 1000.0, 50.0
    time = np.arange(count) / rate
    bound = frequency_bound(time, 2 * math.pi * frequency * time, frequency, [1.0], 0.1, degree=0)
    textbook = math.sqrt(12 * 2 * 0.01 / (count * (count**2 - 1))) * rate / (2 * math.pi) / frequency
    assert bound == pytest.approx(textbook, rel=1e-3)
    chirp = frequency_bound(time, 2 * math.pi * frequency * time, frequency, [1.0], 0.1, degree=1)
    middle = frequency_bound(time, 2 * math.pi * frequency * time, frequency, [1.0], 0.1, degree=1, at_s=0.5)
    assert chirp > 3 * middle


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda: scene("walk", 1.0), "scene must be one of const, act1, act2, harsh, got 'walk'"),
        (lambda: scene("const", 0.0), "wavelength"),
        (lambda: scene("const", 1.0, seconds=0.5).bound(1.0), "does not fit"),
        (lambda: wavelength_bound(np.zeros((2, 2)), 1.0, [1], 1.0), "shapes do not fit"),
        (lambda: frequency_bound([0, 1], [0, 1], 1.0, [1], 1.0, degree=-1), "degree"),
        (lambda: chosen(["nobody"]), "no estimator is called 'nobody'"),
        (lambda: Plan(seeds=()), "seeds must hold at least one seed"),
        (lambda: Plan(seconds=1), "seconds must be at least 2"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(InputError, match=message):
        call()


class Truth:
    """An estimator that knows, `late` samples late, and states a sigma of 1 %."""

    def __init__(self, made, late=0, factor=1.0):
        self.wavelength_mm = factor * made.wavelength_mm
        self.wavelength_sigma_mm = 0.01 * made.wavelength_mm
        self.frequency_Hz = np.roll(made.frequency_Hz, late)


def test_measures_of_a_known_error():
    made = scene("act1", 1.8, seconds=3)
    errors = measures.errors_of(made, Truth(made, factor=1.02))
    assert errors.absolute == pytest.approx(0.02)
    assert errors.answered.all()
    assert errors.sigma_square == pytest.approx(4)
    silent = Truth(made)
    silent.wavelength_mm = np.full(3000, np.nan)
    assert measures.errors_of(made, silent).absolute == pytest.approx(3.0)
    assert not measures.errors_of(made, silent).answered.any()


def test_lag_and_what_remains_of_the_error_without_it():
    made = scene("act1", 1.8, seconds=3)
    late = np.interp(made.time_s - 0.0173, made.time_s, made.frequency_Hz)
    assert measures.lag_ms(made, late) == pytest.approx(17.3, abs=0.1)
    assert measures.lag_ms(made, np.roll(made.frequency_Hz, -12)) == pytest.approx(-12, abs=0.1)
    assert measures.aligned_square(made, late, 17.3) < 1e-5
    assert measures.aligned_square(made, late, 0.0) > 1e-3
    constant = scene("const", 1.8, seconds=3)
    assert math.isnan(measures.lag_ms(constant, np.full(3000, 5.0)))
    noise = np.random.default_rng(0).standard_normal(3000)
    assert math.isnan(measures.lag_ms(made, noise))
    assert math.isnan(measures.aligned_square(made, noise, math.nan))


def test_a_false_lock_is_wrong_and_steady():
    made = scene("const", 1.0, seconds=2.5)
    found = np.ones(2500)
    found[1500:1650] = 2.0
    assert not measures.falsely_locked(made, found)
    found[1500:1750] = 2.0
    assert measures.falsely_locked(made, found)
    found[1500:1750] = np.random.default_rng(0).uniform(1.5, 3.0, 250)
    assert not measures.falsely_locked(made, found)
    found[1500:] = np.nan
    assert not measures.falsely_locked(made, found)


def test_time_to_settle():
    made = scene("const", 1.0, step_to_mm=2.0, step_at_s=2.0, seconds=3)
    late = np.concatenate([np.ones(2030), np.full(970, 2.01)])
    assert measures.settling_ms(made, late, 2.0) == 30
    assert measures.settling_ms(made, np.ones(3000), 2.0) == math.inf


def test_estimators_are_chosen_by_parts_of_their_names():
    assert set(chosen([])) == set(COMPETITORS)
    assert set(chosen(["reciprocal", "SPACE"])) == {"reciprocal in space", "space tracker"}


def test_the_known_velocity_can_be_late_and_wrong():
    made = scene("act1", 1.8, seconds=2)
    assert made.block(5, 1.03)[5:, 1] == pytest.approx(1.03 * made.velocity_mm_s[:-5])
