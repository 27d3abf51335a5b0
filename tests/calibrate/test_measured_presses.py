"""Refit from measured presses: few moduli and noise."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.calibrate import fit_bench
from papilla.calibrate.job import calibrate_measured
from papilla.calibrate.published_form import fit_quadratic
from papilla.calibration import Calibration, SoftnessStatus
from papilla.errors import InputError
from papilla.finger import Finger
from papilla.logs import PressLog

NAMES = ("g1", "g2", "g3", "g4", "g5")
MODULI = (0.089, 0.51, 0.72)


def log_of(truth, moduli=MODULI, presses=30, noise=0.0, seed=0, **columns):
    rng = np.random.default_rng(seed)
    force = np.exp(rng.uniform(np.log(0.08), 0, (len(moduli), presses)))
    force[:, :2] = 0.08, 1.0
    modulus = np.repeat(moduli, presses)
    readings = truth.readings(force.ravel(), modulus)
    readings = readings * (1 + noise * rng.normal(size=len(modulus)))[:, None]
    return PressLog(force.ravel(), modulus, readings, NAMES, **columns)


def test_three_moduli_without_noise(truth, tmp_path):
    calibration = fit_bench(log_of(truth), {"name": "lab finger", "sha256": ""})
    assert calibration.domain["modulus_MPa"] == (0.089, 0.72)
    assert calibration.domain["force_N"] == pytest.approx((0.08, 1.0))
    for modulus in MODULI:
        answer = calibration.invert(truth.sd(0.4, modulus), 0.4, sd_sigma=1.0)
        known = answer.modulus_MPa if answer.status is SoftnessStatus.OK else None
        ends = {0.089: SoftnessStatus.SOFTER, 0.72: SoftnessStatus.HARDER}
        # At the ends of the domain a residual of 0.1 % may carry S_d just outside: then the status says on which side.
        assert known == pytest.approx(modulus, rel=0.03) if known else answer.status is ends[modulus]
    assert calibration.invert(truth.sd(0.4, 0.25), 0.4).modulus_MPa == pytest.approx(0.25, rel=0.05)
    said = " ".join(calibration.notes)
    assert "between the 3 moduli S_d is assumed" in said
    assert "exact interpolation" in said and "polynomial of degree 2 in ln modulus" in said
    calibration.save(tmp_path / "c.json")
    loaded = Calibration.load(tmp_path / "c.json")
    assert loaded.finger["name"] == "lab finger" and loaded.provenance["source"] == "bench log"


@pytest.mark.slow
def test_a_calibration_tells_the_ridges_of_its_finger(truth, tmp_path):
    finger = Finger.default()
    for own, pitch in ((finger, finger.ridges.pitch), (replace(finger, ridges=None), 0.0), (None, None)):
        calibrate_measured(log_of(truth), own).calibration.save(tmp_path / "c.json")
        assert Calibration.load(tmp_path / "c.json").ridge_pitch_mm == pitch


@pytest.mark.slow
def test_intervals_cover_the_noise_of_a_bench():
    """Presses on a quadratic ln S_d with 1 % noise: 95 % of the intervals hold the modulus."""
    rng = np.random.default_rng(5)

    def presses(force, modulus):
        log_sd = 10 + 0.6 * np.log(force) + 0.2 * np.log(modulus) - 0.01 * np.log(modulus) ** 2
        return np.exp(log_sd + 0.01 * rng.normal(size=len(force)))

    pattern = np.array([-1.0, 1.0])
    inside = []
    for _ in range(20):
        force, modulus = np.exp(rng.uniform(-2.5, 0, 60)), np.tile([0.1, 0.25, 0.5, 1.0], 15)
        calibration = fit_bench(PressLog(force, modulus, presses(force, modulus)[:, None] * pattern, ("g1", "g2")))
        low, high = calibration.domain["force_N"]
        asked, hidden = rng.uniform(low, high, 60), np.exp(rng.uniform(np.log(0.1), 0, 60))
        answer = calibration.invert(presses(asked, hidden), asked)
        inside.append((answer.lower_MPa <= hidden) & (hidden <= answer.upper_MPa))
    assert np.mean(inside) == pytest.approx(0.95, abs=0.03)


def test_the_quadratic_is_that_of_all_presses_that_are_kept(truth):
    log = log_of(truth, noise=0.01)
    forward, expected = fit_bench(log).forward, fit_quadratic(log.force_N, log.modulus_MPa, log.sd_microstrain)
    np.testing.assert_array_equal(forward.coefficients, expected.coefficients)


def few_presses(truth, seed, moduli=MODULI, forces=5, force_noise=0.01, noise=5.0, offset=20.0):
    """Presses at planned forces, known to `force_noise`; noise and an offset of each gauge in microstrain."""
    rng = np.random.default_rng(seed)
    modulus, force = (part.ravel() for part in np.meshgrid(moduli, np.linspace(0.1, 1, forces), indexing="ij"))
    readings = (
        truth.readings(force, modulus) + noise * rng.normal(size=(len(force), 5)) + rng.uniform(-1, 1, 5) * offset
    )
    return PressLog(force * (1 + force_noise * rng.normal(size=len(force))), modulus, readings, NAMES)


@pytest.mark.parametrize("seed", range(6))
def test_fifteen_presses_give_an_honest_calibration(truth, seed):
    """3 moduli x 5 forces, force known to 1 %: the surface stays near the truth, and its intervals hold it."""
    calibration = fit_bench(few_presses(truth, seed))
    force = np.geomspace(*calibration.domain["force_N"], 12)[1:-1, None]
    modulus = np.geomspace(0.1, 0.7, 12)
    np.testing.assert_allclose(calibration.predict(force, modulus), truth.sd(force, modulus), rtol=0.04)
    answer = calibration.invert(truth.sd(force, modulus), np.broadcast_to(force, (10, 12)))
    assert np.mean((answer.lower_MPa <= modulus) & (modulus <= answer.upper_MPa)) > 0.9
    assert np.nanmin(answer.sigma_MPa / answer.modulus_MPa) > 0.01
    assert np.isnan(calibration.predict([0.09, 1.1, 0.5, 0.5], [0.3, 0.3, 0.08, 0.75])).all()
    assert "polynomial of degree 2 in ln force and a polynomial of degree 2" in " ".join(calibration.notes)


def test_as_many_unknowns_as_the_presses_bear(truth):
    """9 presses bear a plane and 15 a paraboloid; 27 do not need more."""
    words = [
        next(note for note in fit_bench(few_presses(truth, 1, forces=count)).notes if note.startswith("ln S_d is"))
        for count in (3, 5, 9)
    ]
    degrees = [[int(text.split()[0]) for text in word.split("degree ")[1:]] for word in words]
    assert degrees == [[1, 1], [2, 2], [2, 2]]
    log = few_presses(truth, 1, forces=2)
    log.force_N[:] = 0.1, 1.0, 0.1, 1.0, 0.5, 5.0
    with pytest.raises(InputError, match="3 presses, placed like these, do not bear even a plane"):
        fit_bench(log)


def test_a_computed_table_read_back_is_fitted_as_finely_as_the_sweep(made_up, calibration):
    log = PressLog(made_up.force_N, made_up.modulus_MPa, made_up.reading, NAMES)
    back = fit_bench(log)
    rng = np.random.default_rng(4)
    force, modulus = np.exp(rng.uniform(np.log(0.05), 0, 200)), np.exp(rng.uniform(np.log(0.05), np.log(0.72), 200))
    answer = back.invert(calibration.predict(force, modulus), force)
    assert (answer.status == SoftnessStatus.OK).all()
    np.testing.assert_allclose(answer.modulus_MPa, modulus, rtol=0.003)
    assert not any("left out" in note for note in back.notes)


@pytest.mark.parametrize("gauge", range(5))
def test_a_cell_that_dropped_out_is_named_and_left_out(truth, gauge):
    """One reading of 60 presses is 0: the calibration is the one of the other 59."""
    log = few_presses(truth, 2, forces=20)
    kept = np.arange(60) != 16
    expected = fit_bench(PressLog(log.force_N[kept], log.modulus_MPa[kept], log.readings[kept], NAMES))
    was = log.readings[16, gauge]
    log.readings[16, gauge] = 0.0
    found = fit_bench(log)
    said, clean = found.notes[0], float(truth.readings(log.force_N[16], log.modulus_MPa[16])[gauge])
    assert said.startswith(f"press 17: g{gauge + 1} reads 0 µε where the other presses say ")
    assert float(said.split("say ")[1].split()[0]) == pytest.approx(clean, rel=0.05) and abs(was / clean - 1) < 0.05
    np.testing.assert_array_equal(found.surface.surface.coefficients, expected.surface.surface.coefficients)
    np.testing.assert_array_equal(found.forward.coefficients, expected.forward.coefficients)
    assert found.provenance["left_out"] == 1 and expected.provenance["left_out"] == 0


def test_a_force_in_the_wrong_row_is_told_by_its_sd(truth):
    log = few_presses(truth, 3, forces=20)
    log.readings[25] *= 1.4
    assert fit_bench(log).notes[0].startswith("press 26: S_d is ")


@pytest.mark.slow
def test_clean_logs_lose_no_press_and_junk_is_refused(truth):
    found = [fit_bench(few_presses(truth, seed, forces=12)) for seed in range(12)]
    assert sum(calibration.provenance["left_out"] for calibration in found) <= 1
    log = few_presses(truth, 4, forces=9)
    log.readings[[4, 13, 23], [2, 1, 0]] = 0.0
    with pytest.raises(InputError, match="more than 2 of 27 presses do not go with the others; among them press"):
        fit_bench(log)
    small = few_presses(truth, 4)
    small.readings[[4, 13], [2, 1]] = 0.0
    with pytest.raises(InputError, match="more than 1 of 15 presses"):
        fit_bench(small)
    log.readings[::8] *= 2
    junk = PressLog(log.force_N, log.modulus_MPa, log.readings, NAMES)
    assert any("% rms: far more than a bench" in note for note in fit_bench(junk).notes)


def test_between_three_moduli_the_interval_includes_what_no_press_shows(truth):
    """Clean presses: the residual is nothing, and still the curve between the moduli is not known."""
    found = fit_bench(few_presses(truth, 0, forces=16, force_noise=0, noise=0, offset=0))
    force, modulus = np.geomspace(0.12, 0.9, 10)[:, None], np.geomspace(0.12, 0.6, 30)
    answer = found.invert(truth.sd(force, modulus), np.broadcast_to(force, (10, 30)))
    assert np.mean((answer.lower_MPa <= modulus) & (modulus <= answer.upper_MPa)) > 0.95
    known = found.surface.uncertainty
    assert known.fit_max < 0.002 and known.fit_rms < 0.002 < known.sigmas(np.log(0.4), np.log(0.25))["form"]
    assert known.sigmas(np.log(0.4), np.log(0.51))["form"] < 0.3 * known.sigmas(np.log(0.4), np.log(0.25))["form"]


def test_that_is_a_quarter_of_what_the_last_degree_changes():
    """ln S_d = x + y + 0.3 y^2 at y = -1, 0, 1: the line through the squares is 2/3."""
    pattern, names = np.array([1.0, -1.0]), ("g1", "g2")

    def fitted(moduli):
        x, y = (part.ravel() for part in np.meshgrid(np.linspace(-1, 1, 9), moduli))
        log = PressLog(np.exp(x), np.exp(y), np.exp(x + y + 0.3 * y**2)[:, None] * pattern, names)
        return fit_bench(log).surface.uncertainty

    assert fitted([-1.0, 0.0, 1.0]).fit_max < 1e-12
    # rms over the surface's own 17 nodes, in the shape of y^3 - y
    y = np.linspace(-1, 1, 17)
    change, shape = np.sqrt(np.mean((y**2 - 2 / 3) ** 2)), np.abs(y**3 - y)
    expected = 0.25 * 0.3 * change * shape / np.sqrt(np.mean(shape**2))
    told = [fitted([-1.0, 0.0, 1.0]).sigmas(0.2, one)["form"] for one in y]
    assert told == pytest.approx(expected, abs=0.1 * expected.max())
    more = fitted([-1.0, -0.4, 0.1, 0.5, 1.0])
    assert max(more.sigmas(0.2, one)["form"] for one in y) < 1e-9


@pytest.mark.slow
def test_noise_that_hides_the_rise_is_confessed(truth):
    """10 % noise on three moduli: whatever part falls is not inverted, and a note says how much."""
    found = [fit_bench(log_of(truth, presses=6, noise=0.1, seed=seed)) for seed in range(12)]
    folded = [c for c in found if any("does not rise" in note for note in c.notes)]
    assert folded
    for calibration in folded:
        usable = calibration.surface.usable
        assert (usable[:, 1] - usable[:, 0] < calibration.surface.surface.cells[1]).any()


def test_presses_outside_the_shared_forces_are_counted(truth):
    log = log_of(truth)
    log.force_N[1] = 2.0
    calibration = fit_bench(log)
    assert calibration.domain["force_N"][1] == pytest.approx(1.0)
    assert any(note.startswith("1 presses lie outside") for note in calibration.notes)


@pytest.mark.parametrize(
    "change, message",
    [
        ({"moduli": (0.1, 0.5)}, "three moduli at least, got 2"),
        ({"moduli": (89, 510, 720)}, "modulus_MPa goes from 89 to 720 MPa, .* is it in kPa"),
        ({"moduli": (0.089, 0.51, 720)}, "is it in kPa"),
        ({"x_mm": np.r_[np.zeros(89), 2.0]}, "the presses differ in x_mm \\(0 to 2\\)"),
    ],
)
def test_logs_that_cannot_be_fitted_are_refused(truth, change, message):
    with pytest.raises(InputError, match=message):
        fit_bench(log_of(truth, **change))


@pytest.mark.parametrize(
    "column, factor, message",
    [
        ("force_N", 102.0, "force_N goes from 8.16 to 102 N, which no soft finger takes: is it in gf"),
        ("readings", 1e-6, "readings are expected in microstrain, are these strains"),
    ],
)
def test_logs_in_other_units_are_refused(truth, column, factor, message):
    log = log_of(truth)
    with pytest.raises(InputError, match=message):
        fit_bench(replace(log, **{column: factor * getattr(log, column)}))


def test_a_depth_is_not_used_and_a_curve_is_taken_through_three_moduli(truth):
    """1 % noise hides the curve in ln modulus from a fit of 15 presses, and it is there all the same."""
    for seed in range(6):
        log = few_presses(truth, seed, force_noise=0.03)
        notes = fit_bench(replace(log, indentation_mm=np.ones(len(log)))).notes
        assert any("indentation_mm is not used" in note for note in notes)
        assert any("polynomial of degree 2 in ln modulus" in note for note in notes)


def test_equal_readings_and_unshared_forces_are_refused(truth):
    log = log_of(truth)
    log.readings[3] = 7.0
    with pytest.raises(InputError, match="press 4 has the same reading on all gauges"):
        fit_bench(log)
    apart = log_of(truth)
    apart.force_N[:30] += 5
    with pytest.raises(InputError, match="the moduli share no range of forces"):
        fit_bench(apart)


def test_logs_of_another_sensor_are_refused(truth):
    log = log_of(truth)
    shifted = PressLog(log.force_N, log.modulus_MPa, log.readings, ("g2", "g3", "g4", "g5", "g6"))
    with pytest.raises(InputError, match="gauges g2, g3, g4, g5, g6, but g1 is missing"):
        fit_bench(shifted)
    finger = Finger.default()
    with pytest.raises(InputError, match=r"the log has 5 gauges \(g1, g2, g3, g4, g5\), the finger .* has 3"):
        calibrate_measured(log, replace(finger, gauges=finger.gauges[:3]))


def test_the_recovery_of_a_log_counts_its_answers(truth):
    recovery = calibrate_measured(log_of(truth, noise=0.01)).recovery
    assert recovery.answered == np.isfinite(recovery.recovered_MPa).sum() < len(recovery.error)
