"""The scenes, their Cramér-Rao bound, and the measures of the comparison."""

import math

import numpy as np
import pytest

from papilla.errors import InputError
from papilla.references.cramer_rao import frequency_bound, wavelength_bound
from papilla.studies.estimators import measures
from papilla.studies.estimators.competitors import COMPETITORS, chosen
from papilla.studies.estimators.runner import compare
from papilla.studies.estimators.scenes import SCENES, WAVELENGTHS_MM, profile_amplitudes, scene, sheared


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


def test_a_maximum_likelihood_fit_reaches_the_bound():
    """Gauss-Newton on the whole model, 300 noises: its scatter is the bound within the error of 300 draws."""
    rng = np.random.default_rng(5)
    position, wavelength, amplitudes = np.linspace(0, 9, 90), 2.0, np.array([1 + 0.2j, 0.3j])
    orders = np.array([1, 2])
    found = []
    for _ in range(300):
        carrier = np.exp(-2j * math.pi * position[:, None] * orders / wavelength)
        data = np.real(carrier @ amplitudes) + 0.2 * rng.standard_normal(90)
        wavenumber = 2 * math.pi / wavelength
        for _ in range(4):
            wave = np.exp(-1j * wavenumber * position[:, None] * orders)
            linear = np.column_stack([wave.real, wave.imag, np.ones(90)])
            fit = np.linalg.lstsq(linear, data, rcond=None)[0]
            complex_fit = fit[:2] - 1j * fit[2:4]
            slope = np.real(-1j * orders * position[:, None] * wave @ np.diag(complex_fit)).sum(axis=1)
            step = np.linalg.lstsq(np.column_stack([slope, linear]), data - linear @ fit, rcond=None)[0][0]
            wavenumber += step
        found.append(2 * math.pi / wavenumber / wavelength)
    assert np.std(found) / wavelength_bound(position, wavelength, amplitudes, 0.2) == pytest.approx(1, abs=0.13)


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
        (lambda: compare(seeds=0), "seeds must be at least 1"),
        (lambda: compare(seconds=1), "seconds must be at least 2"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(InputError, match=message):
        call()


class Truth:
    """An estimator that knows, `late` samples late, and states a sigma."""

    def __init__(self, made, late=0, factor=1.0):
        self.wavelength_mm = factor * made.wavelength_mm
        self.wavelength_sigma_mm = 0.01 * made.wavelength_mm
        self.frequency_Hz = np.roll(made.frequency_Hz, late)


def test_measures_of_a_known_error_and_lag():
    made = scene("act1", 1.8, seconds=3)
    errors = measures.errors_of(made, Truth(made, factor=1.02))
    assert errors.mean_square == pytest.approx(0.02**2)
    assert errors.median == pytest.approx(0.02)
    assert errors.sigma_square == pytest.approx(4)
    assert errors.outliers == 0
    assert measures.lag_ms(made, Truth(made, late=17).frequency_Hz) == 17
    assert math.isnan(measures.lag_ms(scene("const", 1.8, seconds=3), np.full(3000, 5.0)))


def test_time_to_settle():
    made = scene("const", 1.0, step_to_mm=2.0, step_at_s=2.0, seconds=3)
    late = np.concatenate([np.ones(2030), np.full(970, 2.01)])
    assert measures.settling_ms(made, late, 2.0) == 30
    assert measures.settling_ms(made, np.ones(3000), 2.0) == math.inf


def test_a_comparison_of_one_estimator():
    result = compare(["reciprocal"], seeds=1, seconds=2, conditions=[("const", 20.0)])
    assert [row.estimator for row in result.rows] == ["reciprocal in space"]
    assert 0 < result.rows[0].error < 0.01
    assert result.to_json()["extras"][0]["block_us"] > 0
    assert set(chosen([])) == set(COMPETITORS)
