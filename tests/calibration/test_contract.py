"""What a calibration holds for any finger: simulate, measure, correct, recover; over a hundred that are drawn."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_sweep import make_sweep, true_sd

from papilla.calibration import Calibration, SoftnessStatus, fit

SEEDS = range(100)
MODULI, FORCES = np.geomspace(0.02, 5, 14), np.geomspace(0.05, 1, 12)


def law(rng):
    """Readings of another finger over those of the made-up one: smooth, and S_d still rises with the modulus."""
    size, by_force, by_modulus = np.exp(rng.uniform(-2, 2)), rng.uniform(-0.2, 0.3), rng.uniform(0.02, 0.15)
    bend, knee = rng.uniform(-0.02, 0.02), rng.uniform(0.05, 0.5)

    def change(force, modulus):
        return size * force**by_force * (modulus / (modulus + knee)) ** by_modulus * np.exp(bend * np.log(force) ** 2)

    return change


def drawn(seed):
    """A calibration of a drawn finger, its true S_d, and points inside of its domain."""
    rng = np.random.default_rng(seed)
    change = law(rng)
    inside = [np.exp(rng.uniform(*np.log([ends[0], ends[-1]]), 8)) for ends in (FORCES, MODULI)]
    return fit(make_sweep(MODULI, FORCES, change)), lambda f, e: true_sd(f, e) * change(f, e), *inside


def answers(calibration, sd, force):
    """Everything that an inversion says, as a table."""
    found = calibration.invert(sd, force, sd_sigma=0.01 * sd, force_sigma=0.002)
    return np.array([found.modulus_MPa, found.sigma_MPa, *found.interval, found.status])


@pytest.mark.parametrize("seed", SEEDS)
def test_a_modulus_is_recovered_and_predict_of_invert_is_the_identity(seed):
    calibration, true, force, modulus = drawn(seed)
    sd = calibration.predict(force, modulus)
    back = calibration.invert(sd, force)
    np.testing.assert_allclose(back.modulus_MPa, modulus, rtol=1e-10)
    (low, high), (lower, higher) = back.interval, calibration.invert(sd, force, sd_sigma=0.05 * sd).interval
    assert (lower <= low).all() and (high <= higher).all()
    np.testing.assert_allclose(calibration.predict(force, back.modulus_MPa.clip(*calibration.domain["modulus_MPa"])),
                               sd, rtol=1e-13)  # fmt: skip
    measured = calibration.invert(true(force, modulus), force)
    soft = (modulus < 1) & (force > 0.06) & (force < 0.9) & (modulus > 0.025)
    assert (measured.status[soft] == SoftnessStatus.OK).all()
    np.testing.assert_allclose(measured.modulus_MPa[soft], modulus[soft], rtol=0.02)


@pytest.mark.parametrize("seed", SEEDS)
def test_saved_and_loaded_it_is_the_same(seed, tmp_path):
    calibration, _, force, modulus = drawn(seed)
    sd = calibration.predict(force, modulus)
    calibration.save(tmp_path / "c.json")
    loaded = Calibration.load(tmp_path / "c.json")
    np.testing.assert_array_equal(answers(loaded, sd, force), answers(calibration, sd, force))
    np.testing.assert_array_equal(loaded.predict_readings(force, modulus), calibration.predict_readings(force, modulus))
    loaded.save(tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == (tmp_path / "c.json").read_bytes()


@pytest.mark.parametrize("seed", SEEDS[::10])
def test_order_of_presses_and_gain_of_the_amplifier_do_not_matter(seed):
    """Readings in another unit are another S_d and the same modulus; gauges may come in any order."""
    rng, table = np.random.default_rng(seed), make_sweep(MODULI, FORCES, law(np.random.default_rng(seed)))
    calibration, _, force, modulus = drawn(seed)
    sd = calibration.predict(force, modulus)
    order, gauges = rng.permutation(len(table)), rng.permutation(5)
    columns = ("force_N", "modulus_MPa", "reading", "sd_microstrain", "indentation_mm", "contact_area_mm2")
    mixed = {name: getattr(table, name)[order] for name in (*columns, "peak_pressure_MPa", "resolved")}
    mixed["reading"] = mixed["reading"][:, gauges]
    other = fit(replace(table, **mixed, gauge_names=tuple(table.gauge_names[k] for k in gauges)))
    np.testing.assert_allclose(answers(other, sd, force), answers(calibration, sd, force), rtol=1e-6)
    np.testing.assert_allclose(
        other.predict_readings(force, modulus), calibration.predict_readings(force, modulus)[:, gauges], rtol=1e-9
    )
    louder = fit(replace(table, reading=3 * table.reading, sd_microstrain=3 * table.sd_microstrain))
    np.testing.assert_allclose(answers(louder, 3 * sd, force), answers(calibration, sd, force), rtol=1e-6)


def test_intervals_over_all_drawn_fingers_cover_as_often_as_they_say():
    rng, inside, close = np.random.default_rng(1), [], []
    for seed in SEEDS[::2]:
        calibration, true, force, modulus = drawn(seed)
        modulus = 0.04 * (modulus / 0.02) ** 0.4
        sigma = 0.01 * true(force, modulus)
        noisy = force * (1 + 0.005 * rng.normal(size=force.shape))
        measured = true(force, modulus) + sigma * rng.normal(size=force.shape)
        found = calibration.invert(measured, noisy, sd_sigma=sigma, force_sigma=0.005 * force)
        pressed = (noisy > 0.05) & (noisy < 1)
        inside += [*((found.lower_MPa <= modulus) & (modulus <= found.upper_MPa))[pressed]]
        close += [*(np.abs(found.modulus_MPa - modulus) < found.sigma_MPa)[pressed]]
    assert np.mean(inside) == pytest.approx(0.95, abs=0.03) and np.mean(close) == pytest.approx(0.68, abs=0.06)
