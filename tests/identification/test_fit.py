"""What a fit of real presses on a coarse family knows: weights, influence, records, suggestions, creep, noise."""

import re
from dataclasses import replace

import numpy as np
import pytest
from drawn_finger import SIZE_MM, made
from spring_calibration import calibration

from papilla.calibration import Calibration
from papilla.core.errors import InputError
from papilla.identification import (
    PARAMETERS_BY_NAME,
    PressNoise,
    diagnose,
    fit_relaxation,
    identify,
    record,
    suggest_presses,
)
from papilla.identification.diagnosis import influence_by_parameter
from papilla.identification.fit import solve
from papilla.identification.identified_finger import Change, PressAgreement, with_identification
from papilla.identification.noise import estimated_noise
from papilla.identification.one_touch import crept, fit_touch
from papilla.identification.page import weighted_residuals, write_identification
from papilla.identification.posing import free_parameters, problem_of, specimens_of
from papilla.logs import PressLog
from papilla.model.finger import Finger
from papilla.references import Prony

FINGER, STUCK = Finger.default(), {"size_mm": SIZE_MM, "friction": "stick"}
MODULI = ("outer_modulus_MPa", "inner_modulus_MPa")


@pytest.fixture(scope="module")
def pressed(smooth):
    """Presses of a drawn finger, and its parameters."""
    return made(smooth, 21, forces=np.geomspace(0.1, 0.9, 6))


@pytest.fixture(scope="module")
def found(pressed):
    return identify(pressed[0], FINGER, **STUCK)


@pytest.fixture(scope="module")
def stored(found):
    """The identified finger with its record."""
    return found.with_record(record(found, diagnose(found), "block"))


def test_residuals_over_their_noise_are_about_one_and_large_ones_count_less(found):
    assert 0.3 < np.sqrt((weighted_residuals(found) ** 2).mean()) < 1.5
    assert found.freedom < found.problem.measured.size
    readings = found.problem.log.readings.copy()
    readings[2, 1] += 5000.0
    off = replace(found.problem, log=replace(found.problem.log, readings=readings))
    whitened = (off.weights @ (off.measured - off.modelled(found.vector).values)[:, :, None])[:, :, 0]
    counted = off.downweighted(found.vector).robust
    assert counted**2 == pytest.approx(1 / (1 + (whitened / 4) ** 2)) and counted[2].min() < 0.3


def test_influence_is_that_of_a_fit_without_the_press(found):
    residuals, jacobian = found.problem.linearised(found.vector)
    count, width = found.problem.measured.shape
    spread = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    influence = influence_by_parameter(found)
    for press in range(count):
        kept = np.delete(np.arange(len(jacobian)), width * press + np.arange(width))
        step, *_ = np.linalg.lstsq(jacobian[kept], residuals[kept], rcond=None)
        for name in MODULI:
            place = found.names.index(name)
            assert influence[name][press] == pytest.approx(abs(step[place]) / spread[place], rel=0.1, abs=0.05)


def test_a_covariance_is_the_inverse_of_the_information(found):
    jacobian = found.problem.jacobian(found.vector)
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    widened = max(1.0, found.chi_square / found.freedom) if found.chi_square > 1.5 * found.freedom else 1.0
    np.testing.assert_allclose(np.diag(found.covariance), widened * np.diag(inverse), rtol=1e-3)


def test_what_a_log_has_says_what_is_free():
    log = PressLog(np.ones(6), np.array([0.2, 0.5, 0.2, 0.2, 0.9, 0.9]), np.zeros((6, 5)),
                   tuple(f"g{k}" for k in range(1, 6)))  # fmt: skip
    each = {f"{key}.g{k}" for key in ("gain", "lever_mm", "zero_microstrain") for k in range(1, 6)}
    assert set(free_parameters(log, FINGER, (), {})) == {*MODULI, *each}
    deep = replace(log, indentation_mm=np.ones(6))
    assert set(free_parameters(deep, FINGER, (), {"gain.g1": 1.0})) == {*MODULI, *each, "touch_down_mm"} - {"gain.g1"}
    alone = replace(log, stated_sd=np.ones(6), readings=np.zeros((6, 0)), gauge_names=())
    assert {*free_parameters(alone, FINGER, (), {})} == {*MODULI, "common_gain", "common_lever_mm"}
    assert specimens_of(log) == {}
    doubtful = replace(log, modulus_sigma_MPa=np.array([0.02, 0.0, 0.02, 0.06, 0.27, 0.27]), on=np.arange(6) == 3)
    assert {name: one.rows.tolist() for name, one in specimens_of(doubtful).items()} == {
        "specimen_modulus.0.2": [0, 2], "specimen_modulus.0.2#2": [3], "specimen_modulus.0.9": [4, 5],
    }  # fmt: skip


def test_priors_and_bounds_are_those_of_their_sources():
    """A factor of 2 between batches; levers anywhere from -2 to 1 times the gain; a hand that glues to 1 mm."""
    double, lever, hand, tilt = (np.log(2), 1.6, 1.6), 3 / np.sqrt(12), (1.0, 1.5, 1.5), (1.5, 3.0, 3.0)
    expected = {
        "outer_modulus_MPa": double, "inner_modulus_MPa": double, "thickness_mm": (0.03, 0.25, 0.25),
        "gain": (2.0, 20, 20), "lever_mm": (lever, 20, 20), "zero_microstrain": (1e3, 1e5, 1e5),
        "touch_down_mm": (0.5, 2, 2), "row_along_mm": hand, "row_across_mm": hand, "place_mm": hand,
        "tilt_x_deg": tilt, "tilt_y_deg": tilt, "stick_share": (0.5, 0.5, 0.5), "common_lever_mm": (lever, 2.0, 1.0),
        "common_gain": (3.0, np.log(1e4), np.log(1e4)), "specimen_modulus": (0.1, 0.5, 0.5),
    }  # fmt: skip
    stated = {name: (one.sigma, -one.low, one.high) for name, one in PARAMETERS_BY_NAME.items()}
    assert stated.keys() == expected.keys()
    for name, numbers in stated.items():
        assert numbers == pytest.approx(expected[name], rel=0.02), name
    assert {name for name, one in PARAMETERS_BY_NAME.items() if one.linear} == {
        "gain", "lever_mm", "zero_microstrain", "touch_down_mm",
    }  # fmt: skip


def test_gauges_of_the_identified_finger_are_moved_by_the_row_and_their_own_place(found):
    moves = {"row_along_mm": 0.3, "row_across_mm": -0.2, "place_mm.g2": 0.1}
    moved = replace(found, problem=replace(found.problem, held={**found.problem.held, **moves})).finger
    for gauge, other in zip(found.finger.gauges, moved.gauges, strict=True):
        along = 0.3 + 0.1 * (gauge.name == "g2")
        assert np.subtract(other.moved_mm, gauge.moved_mm) == pytest.approx([along, -0.2])
        assert (other.membrane_gain, other.lever_mm) == (gauge.membrane_gain, gauge.lever_mm)


def test_what_an_identification_leaves_open_widens_every_interval(stored, tmp_path):
    plain = calibration()
    wider = with_identification(plain, stored, size_mm=SIZE_MM)
    force, modulus = np.array([0.3, 0.6]), np.array([0.1, 0.3])
    sd = plain.predict(force, modulus)
    np.testing.assert_array_equal(wider.predict(force, modulus), sd)
    (low, high), (lower, higher) = plain.invert(sd, force).interval, wider.invert(sd, force).interval
    assert (lower < low).all() and (high < higher).all() and 0 < wider.sigmas["identification"] < 0.5
    assert wider.finger["zeros_microstrain"] == pytest.approx(stored.identified.zeros_microstrain)
    wider.save(tmp_path / "c.json")
    np.testing.assert_array_equal(Calibration.load(tmp_path / "c.json").invert(sd, force).interval, [lower, higher])
    assert with_identification(plain, FINGER) is plain
    sharp = replace(stored.identified, covariance=tuple(tuple(0.01 * x for x in row)
                                                        for row in stored.identified.covariance))  # fmt: skip
    sharper = with_identification(plain, replace(stored, identified=sharp), size_mm=SIZE_MM)
    assert sharper.sigmas["identification"] == pytest.approx(0.1 * wider.sigmas["identification"], rel=1e-6)


def test_a_finger_is_saved_with_its_record_and_a_design_that_was_changed_since_is_refused(stored, tmp_path):
    stored.save(tmp_path / "finger.toml")
    assert Finger.load(tmp_path / "finger.toml") == stored
    changed = replace(stored, outer=replace(stored.outer, modulus=2 * stored.outer.modulus))
    with pytest.raises(InputError, match="outer_modulus_MPa is .* the design was changed since"):
        with_identification(calibration(), changed, size_mm=SIZE_MM)


def test_a_finger_is_another_below_one_per_cent():
    for probability, rise, same, named in ((0.01, 9, True, False), (0.0099, 6.7, False, True), (0, 6.5, False, False)):
        agreement = PressAgreement(3, 40.0, 20, probability, (Change("touch_down_mm", -0.12, 0.02, rise),))
        assert agreement.same == same and ("touch_down_mm -0.12 +- 0.02 mm" in agreement.verdict) == named


def test_a_diagnosis_states_intervals_influence_and_each_doubt_once(found):
    told = diagnose(found)
    *separate, backwards = told.notes
    assert all(note.startswith("the presses do not separate lever and gain of ") for note in separate)
    assert backwards.startswith("g2 reads backwards") and told.profiles == ()
    assert told.status == (
        "ok, but 1 of 5 gauges read backwards: identified from 12 presses, "
        f"chi-square {found.chi_square:.3g} at {found.freedom:.3g} degrees of freedom"
    )
    for place, name in enumerate(found.names):
        ends = found.vector[place] + np.array([-1.959964, 1.959964]) * found.sigma[place]
        assert told.intervals[name] == pytest.approx(np.exp(ends) if name in MODULI else ends)
    assert told.influence == pytest.approx(np.max(list(influence_by_parameter(found).values()), axis=0))
    rows = found.problem.jacobian(found.vector)[: -len(found.names) - 1]
    assert told.condition == pytest.approx(np.linalg.cond(rows / np.linalg.norm(rows, axis=0)))
    zeros = [found.values[f"zero_microstrain.g{k}"] for k in range(1, 6)]
    assert found.measured_sd == pytest.approx((found.problem.log.readings - zeros).std(axis=1))


def test_what_is_wrong_with_a_fit_is_named(found):
    close, n = found.covariance.copy(), len(found.names)
    close[0, 1] = close[1, 0] = 0.97 * found.sigma[0] * found.sigma[1]
    at_bound = np.where(np.arange(n) == 0, found.problem.bounds[1][0], found.vector)
    outside = np.where(np.arange(n) == 0, found.vector[1] + np.log(16) + 0.05, found.vector)
    for change, doubt in (
        ({"chi_square": 2 * found.freedom}, "the model does not fit: chi-square is 2 times its freedom"),
        ({"rival": 3.8}, "another finger fits as well, chi-square only 3.8 more"),
        ({"covariance": close}, r"outer_modulus_MPa and inner_modulus_MPa are determined together only .* 0.970"),
        ({"vector": at_bound}, "outer_modulus_MPa ended at its bound"),
        ({"vector": outside}, "the ratio of the moduli is 5 % outside of 1 to 16"),
    ):
        doubts = diagnose(replace(found, **change)).notes
        assert sum(re.match(doubt, told) is not None for told in doubts) == 1, doubts
    for change in ({"chi_square": 1.4 * found.freedom}, {"rival": 3.9}):
        assert not re.search("does not fit|fits as well", " ".join(diagnose(replace(found, **change)).notes))


def test_the_page_has_the_numbers(found, tmp_path):
    write_identification(tmp_path / "i.html", found, diagnose(found))
    page = (tmp_path / "i.html").read_text()
    shown = np.array([float(number) for number in re.findall(r"[0-9]+\.[0-9]+", page)])
    assert np.isclose(shown, found["outer_modulus_MPa"][0], rtol=0.03).any(), "two digits at least"
    assert "lever_mm.g5" in page and "<script" not in page


def test_the_press_that_is_suggested_beats_every_other_one(found):
    forces, moduli = (0.1, 0.4, 0.9), (0.089, 0.72)
    best = suggest_presses(found, 1, moduli, forces=forces, size_mm=SIZE_MM)
    each = {(force, modulus): suggest_presses(found, 1, (modulus,), forces=(force,), size_mm=SIZE_MM).sigma_after
            for force in forces for modulus in moduli}  # fmt: skip
    assert best.sigma_after == pytest.approx(min(each.values()))
    assert each[float(best.force_N[0]), float(best.modulus_MPa[0])] == pytest.approx(best.sigma_after)
    more = suggest_presses(found, 4, moduli[::-1], forces=forces[::-1], size_mm=SIZE_MM)
    assert more.sigma_before == best.sigma_before > best.sigma_after > more.sigma_after
    determinant = suggest_presses(found, 4, moduli, forces=forces, criterion="D", size_mm=SIZE_MM)
    assert determinant.criterion == "D" and more.sigma_after <= determinant.sigma_after * (1 + 1e-9)


@pytest.mark.parametrize(
    "count, moduli, options, message",
    [
        (True, (0.1,), {}, "number of presses to suggest must be at least 1, got True"),
        (2, (), {}, "at least one force and one modulus"),
        (2, (0.1,), {"forces": (0.0,)}, r"force \(N\) to press must be greater than 0"),
        (2, (0.1,), {"places": ()}, "at least one place"),
        (2, (0.1,), {"criterion": "A"}, "criterion must be I or D, got 'A'"),
    ],
)
def test_what_cannot_be_suggested_is_refused(count, moduli, options, message):
    with pytest.raises(InputError, match=message):
        suggest_presses(FINGER, count, moduli, **options)


def test_repeats_tell_the_noise_that_was_put_in(smooth):
    log, _ = made(smooth, 31, noise=20.0, force_error=0.03, forces=np.repeat([0.2, 0.5, 0.9], 12), moduli=(0.3,))
    posed = problem_of(log, FINGER, size_mm=SIZE_MM, friction="stick")
    fitted = solve(posed)
    told = estimated_noise(replace(posed, noise=PressNoise()), fitted.vector)
    assert told.repeats == 33 and told.readings_microstrain == pytest.approx(20.0, rel=0.4)
    assert told.force == pytest.approx(0.03, rel=0.5) and "estimated from 33 repeats" in told.words
    for change in ({"modulus_MPa": 0.1 + 0.01 * np.arange(36)}, {"x_mm": 0.05 * np.arange(36)}, {"on": np.arange(36)},
                   {"t_s": np.arange(36.0)}):  # fmt: skip
        other = replace(posed, noise=PressNoise(), log=replace(log, **change))
        assert estimated_noise(other, fitted.vector) == PressNoise(), change


@pytest.mark.parametrize("deep", [True, False])
def test_the_longest_touch_of_a_log_is_fitted_by_the_finger_that_was_identified(smooth, found, deep):
    """By depth or, without it, by S_d; the loading rows say by how much the equivalent force exceeds the force."""
    prony, time = Prony((0.3,), (2.0,)), np.concatenate([np.linspace(0.05, 1, 20), np.linspace(1.2, 25, 60)])
    force = 0.5 * np.minimum(time, 1.0)
    at = found.at(prony.strained(time, force), np.full(80, 0.51))
    log = PressLog(force, np.full(80, 0.51), at[:, :5], found.problem.log.gauge_names, at[:, 5] if deep else None,
                   t_s=time)  # fmt: skip
    touch = fit_touch(found, log, 1)
    assert touch.by == ("indentation" if deep else "S_d") and touch.modulus_MPa == 0.51
    assert touch.fitted.prony.shares == pytest.approx((0.3,), rel=0.1)
    assert touch.fitted.prony.times_s == pytest.approx((2.0,), rel=0.2)
    assert touch.crept == crept(touch.fitted.prony, log) and 1.0 <= touch.crept[0] < touch.crept[1] < 1 / 0.65
    assert touch.to_json()["by"] == touch.by and touch.recorded["relaxation_shares"] == touch.fitted.prony.shares
    assert fit_relaxation(time, force, at[:, 5]).rms >= 0
