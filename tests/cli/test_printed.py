"""What commands print of a result: numbers, units and words, from results that are made up."""

import json
import math
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.cli import calibrate, estimate_summary, identify, output, press, slide, texture, verify
from papilla.cli.options import SpecimenOptions
from papilla.core.errors import InputError
from papilla.logs import read_time_log
from papilla.model.finger import Finger
from papilla.model.textures import MeasuredProfile
from papilla.telepresence import LocalModel
from papilla.telepresence.cli import commands as telepresence
from papilla.telepresence.cli import ends as telepresence_ends
from papilla.telepresence.cli import options as telepresence_options

INVERSE = {"coefficients": [0.5, 0.25, -2.0, 3.0], "shift": 0.6, "branch": 1, "modulus_MPa": [0.1, 2.0]}
QUADRATIC = {"coefficients": [-1.5, 20.0, 3.0, 40.0, -5.0], "stderr": [0.25, None, 1.0, 2.0, 3.0]}
SUMMARY = {
    "softness": {"forward": QUADRATIC, "inverse": INVERSE, "compact": None},
    "presses": 300,
    "checked_presses": 50,
    "unanswered": 7,
    "max_error": 0.021,
    "rms_error": 0.004,
    "seconds": 12.34,
    "bench": None,
    "published": None,
    "truth": None,
    "physics": "blocks 10 mm thick",
    "dominant": "friction",
    "sigmas": {"fit": 0.002, "friction": 0.01, "scatter": 0.0},
    "notes": ["too few presses"],
    "calibration": "c.json",
    "sweep": "s.csv",
    "report": "r.html",
}


def test_a_calibration_in_words(capsys):
    calibrate._print(SUMMARY, None, None)
    said = capsys.readouterr().out
    for part in (
        "300 presses; S_d", "-1.5 ± 0.25", "20 ± nan", "2.1 │ %, 43 of 50 answered", "0.4 │ %, 43", "12.3 │ s",
        "E = sqrt(0.5 S_d +0.25 f² -2 f +3) -0.6, where it rises: 0.1 to 2 MPa", "7 of them unanswered",
        "Pressed on: blocks 10 mm thick", "dominant: friction (one sigma of S_d: fit 0.2 %, friction 1 %)",
        "Doubt: too few presses.", "Wrote c.json, s.csv, r.html",
    ):  # fmt: skip
        assert part in " ".join(said.replace("│", " │ ").split()), part


def test_the_sign_of_an_inverse_and_what_has_none():
    falling = INVERSE | {"branch": -1, "shift": -0.25}
    assert "E = -sqrt(" in calibrate._inverse_in_words(falling) and ") +0.25," in calibrate._inverse_in_words(falling)
    assert "no inverse" in calibrate._inverse_in_words(INVERSE | {"modulus_MPa": None})
    assert [calibrate._percent(share) for share in (None, math.nan, 0.25)] == ["none", "none", "25"]


def test_a_bench_and_the_published_curve_in_words(capsys):
    moduli = {"outer_modulus_MPa": {"value": 0.14, "lower": 0.1, "upper": 0.2, "free": True}}
    moduli["inner_modulus_MPa"] = {"value": 0.034, "free": False}
    of_bench = {"status": "converged", "parameters": moduli, "presses": 20, "unanswered": 3}
    of_bench |= {"max_error": 0.3, "rms_error": 0.1, "inside_interval": 16}
    published = {"rms": 0.04, "rms_30_100_gf": 0.03, "press_rms": 0.05, "press_rms_30_100_gf": 0.02}
    truth = {"presses": 9, "sd_max_error": {"0": 0.01}, "max_error": {"0": 0.2}, "inside_interval": 0.95}
    calibrate._print(SUMMARY | {"bench": of_bench, "published": published, "truth": truth}, None, None)
    said = capsys.readouterr().out
    assert "moduli 0.14 (0.1 to 0.2), 0.034 (held) MPa" in said
    assert "30 % at most, 10 % rms, 17 of 20 answered; the 95 % interval holds it for 16" in said
    assert "rms error 4 % of its rms over 10-100 gf, 3 % over 30-100 gf; press by press 5 and 2 %" in said
    assert "Off 9 presses" in said and "friction 0 1 % of S_d, 20 % of E" in said and "holds 95 %" in said


def test_an_identification_in_words(capsys):
    parameters = {
        "outer_modulus_MPa": {"value": 0.136, "free": True, "lower": 0.1, "upper": 0.2},
        "lever_mm": {"value": 0.5, "free": False},
        "zero.g1": {"value": 0.0, "free": False},
        "zero.g2": {"value": 0.0, "free": False},
    }
    summary = {"parameters": parameters, "presses": 15, "physics": "blocks", "status": "fits", "doubts": ["one"]}
    summary |= {"noise": {"words": "5 microstrain"}, "finger": "f.toml"}
    identify._print(summary)
    said = " ".join(capsys.readouterr().out.split())
    for part in ("15 presses on: blocks", "MPa 0.1 to 0.2", "mm held", "Held where they start: zero.", "Doubt: one."):
        assert part in said, (part, said)
    assert "Wrote f.toml" in said and "Press next" not in said


@pytest.mark.parametrize("at, words", [(0.0, "Press next, at the apex:"), (3.0, "MPa at 3, 0 mm")])
def test_suggested_presses_in_words(capsys, at, words):
    press = {"force_N": 0.25, "modulus_MPa": 0.5, "x_mm": at, "y_mm": 0.0}
    sigma = {"before": 1.5, "after": 0.125}
    identify._print_suggestion({"suggested": [press], "expected_sigma_ln_E": sigma})
    said = " ".join(capsys.readouterr().out.split())
    assert words in said and "press 1" in said and "0.25 N on 0.5" in said
    assert "uncertain by 12 %" in said and "now more than a factor of two" in said


def test_relaxation_in_words(capsys):
    term = {"share": 0.2, "share_sigma": 0.05, "time_s": 3.0}
    fitted = {"by": "g3", "modulus_MPa": 0.51, "terms": [term], "doubts": ["short"]}
    identify._print_relaxation({"relaxation": fitted})
    said = " ".join(capsys.readouterr().out.split())
    assert "by g3 on 0.51 MPa" in said and "0.2 ± 0.05 at 3" in said and "Doubt: short." in said


FACTS = {
    "wavelength_mm": 2.0, "mean_force_N": 0.3, "mean_depth_mm": 0.5, "effective_length_mm": 9.0, "gauges": ["g1"],
    "mean_microstrain": [120.0], "sd_microstrain": [7.5], "dynamics": "modal", "seconds": 1.5, "samples": 500,
    "rate_Hz": 1000.0, "log": "l.csv", "truth": "t.json", "why": "fast", "loss_factor": 0.1, "loss_from": "stated",
    "status": "ok", "at_rest": None,
}  # fmt: skip
REST = {"indentation_mm": 0.75, "sd_microstrain": 300.0, "reading_microstrain": [90.0], "physics": "a flat"}


def test_a_slide_in_words(capsys):
    slide._print(FACTS | {"at_rest": REST | {"added_microstrain": [10.0]}})
    said = " ".join(capsys.readouterr().out.split())
    for part in ("500 samples at 1000 Hz in l.csv; truth in t.json", "120, 7.5", "0.75", "90, 10", "loss factor 0.1"):
        assert part in said, part
    slide._print(FACTS | {"dynamics": "quasi-static", "wavelength_mm": None})
    said = capsys.readouterr().out
    assert "loss factor" not in said and "at rest" not in said and "none known" in said


def test_a_simulated_link_in_words(capsys):
    both = {"local": 1.0, "direct": 120.0}
    found = {key: both for key in ("silent", "bytes_per_s", "stale_ms")}
    found |= {"wavelength_error": {"local": 0.01, "direct": math.nan}, "change_ms": dict.fromkeys(both, math.nan)}
    found |= {
        "lag_ms": both | {"round_trip": 119.5},
        "status": {"local": {"ok": 0.75, "silence": 0.25}},
        "table": "t.csv",
    }
    one = {"value": 2.0, "sigma": None, "status": "ok"}
    found["told"] = {"a": one | {"true": 2.5}, "b": one | {"true": math.nan}, "c": one | {"value": None, "true": 1.0}}
    telepresence._print(found)
    captured = capsys.readouterr()
    said = " ".join(captured.out.replace("│", " ").split())
    for part in (
        "round trip 119.5 ms", "wavelength error, local 1.00 %", "wavelength error, direct nothing is displayed",
        "lag behind the hand, direct 120.0 ms", "a 2 ± nan (ok) true 2.5", "Wrote t.csv",
    ):  # fmt: skip
        assert part in said, (part, said)
    assert "new texture after" not in said and "c " not in said.split("a 2 ±")[1]
    assert "true nan" not in said
    assert captured.err.strip() == "local, 25.0 % of the time: silence"


def test_the_two_ways_of_a_link_share_its_delay():
    options = {"jitter_ms": 2.0, "loss": 0.1, "reordering": 0.0, "duplication": 0.0, "bandwidth": None}
    up, down = telepresence.LinkOptions(100.0, 40.0, 0.25, **options).ways()
    assert (up.one_way_ms, down.one_way_ms) == (25.0, 75.0)
    assert up.one_way_sd_ms**2 + down.one_way_sd_ms**2 == pytest.approx(40.0**2) and up.one_way_sd_ms == 20.0
    assert up.jitter_ms == down.jitter_ms == 2.0 and up.loss == 0.1
    with pytest.raises(InputError, match="--uplink-share"):
        telepresence.LinkOptions(100.0, 40.0, 1.25, **options).ways()
    with pytest.raises(InputError, match="--bandwidth"):
        telepresence.LinkOptions(100.0, 40.0, 0.0, **options | {"bandwidth": 0.0}).ways()


def test_quantiles_of_periods_are_in_ms():
    spread = SimpleNamespace(quantile_s=lambda share: share)
    assert telepresence_ends._quantiles_ms(spread) == {"p50": 500.0, "p99.9": 999.0}
    assert telepresence_ends._time(None) == math.inf and telepresence_ends._time(2.0) == 2.0


LINE = {
    "wavelength_mm": 1.5, "wavelength_sigma_mm": 0.01, "ok_rows": 50, "strength": 3.0,
    "harmonic": 2, "fundamental_mm": 3.0,
}  # fmt: skip


def summary(**more) -> dict:
    """A summary of 200 rows, half of them ok."""
    quantities = ("modulus", "frequency", "wavelength", "friction")
    found: dict = {key: None for key in estimate_summary.LAST}
    found |= {"rows": 200, "ok_rows": dict.fromkeys(quantities, 100), "lines": [LINE, LINE | {"ok_rows": 0}]}
    found |= {"statuses": {name: {"ok": 100, "no contact": 60, "searching": 30, "vague": 10} for name in quantities}}
    return found | more


def test_results_of_an_estimate_have_intervals_and_reasons():
    last = {"modulus_MPa": 0.5, "modulus_sigma_MPa": 0.1, "t_s": 1.0}
    friction = {"mu_kinetic": 0.4, "mu_kinetic_sigma": 0.01, "mu_static": 0.5, "mu_static_sigma": math.nan}
    rows = estimate_summary._results(summary(last_answer=last, last_friction=friction))
    assert rows[0] == ("modulus", "0.5 MPa", "0.304 to 0.696", "50 %", "no contact 30 %, searching 15 %")
    assert rows[1][:3] == ("frequency", "-", "") and [row[0] for row in rows[3:]] == [
        "kinetic friction",
        "static friction",
    ]
    assert rows[3][1:3] == ("0.4", "0.3804 to 0.4196") and rows[4][1:3] == ("0.5", "")
    alone = summary()
    alone["statuses"]["modulus"] = {"no calibration": 200}
    assert estimate_summary._results(alone)[0][4] == "no calibration"
    alone["statuses"]["frequency"] = {estimate_summary.FREQUENCY_ALONE: 150, "searching": 50}
    assert estimate_summary._results(alone)[1][4] == "searching 25 %"


def test_lines_that_no_row_agrees_with_are_not_shown():
    (row,) = estimate_summary._lines(summary())
    assert row == ("line of the log", "1.5 mm", "1.4804 to 1.5196", "25 %", "strength 3, harmonic 2 of 3 mm")


def test_doubts_about_lines_and_speed():
    outside = estimate_summary._of_lines([LINE | {"wavelength_mm": 50.0, "harmonic": 1}], None)
    assert len(outside) == 1 and "the strongest line, 50 mm, is outside the 0.4 to 6 mm" in outside[0]
    assert estimate_summary._of_lines([LINE | {"wavelength_mm": 50.0}], (1.0, 60.0)) == []
    in_no_row = [LINE | {"ok_rows": 0, "harmonic": 1}, LINE | {"ok_rows": 0, "wavelength_mm": 1.0}]
    assert (
        "1 of the whole log, the strongest 1.5 mm, are ok in no row" in estimate_summary._of_lines(in_no_row, None)[0]
    )
    codes = Counter({"ok, constant speed": 30, "ok": 70})
    assert "30 of the 100 ok rows" in estimate_summary._of_speed(codes, 100)[0]
    assert estimate_summary._of_speed(Counter({"ok": 70}), 70) == []


def test_counts_of_a_log():
    found = {
        "rows": 9,
        "sample_rate_Hz": 1000.0,
        "nan_rows": 1,
        "gaps": 2,
        "duplicates": 3,
        "gauge_noise_microstrain": 4.0,
    }
    assert estimate_summary._counts(found | {"force_noise_N": None}).startswith("9 rows at 1000 Hz; 1 rows")
    assert "noise 4 µε and 0.002 N; " in estimate_summary._counts(found | {"force_noise_N": 0.002})


def test_codes_that_say_all_need_no_legend():
    codes = {"ok": "ok", "no contact": "the finger touches nothing", "searching": "searching"}
    assert estimate_summary.legend({"legend": {"modulus": codes}}) == [
        "  modulus, no contact: the finger touches nothing"
    ]


def test_cases_of_verify_in_words(capsys):
    case = {"what": "cube", "cause": "patch", "value": 2e-3, "bound": 1e-2, "passed": True, "seconds": 1.25}
    cases = [SimpleNamespace(**case), SimpleNamespace(**case | {"what": "ball", "value": 0.5, "passed": False})]
    verify._print(cases)
    said = capsys.readouterr().out
    assert "2 cases, 1 outside their bounds, 2 s" in said and "MISSED" in said and "2.0e-03" in said and "1e-02" in said
    assert verify.case_keys(cases[1]) == {
        "name": "ball", "measure": "patch", "error": 0.5, "bound": 1e-2, "passed": False, "seconds": 1.25,
    }  # fmt: skip


def test_groups_of_a_texture_are_speeds_if_every_label_has_two():
    two = [("a", 10.0), ("a", 20.0), ("b", 10.5), ("b", 20.0)]
    groups, left_out = texture._groups(two)
    assert left_out == "a speed" and groups[0] == groups[2] and groups[1] == groups[3] != groups[0]
    assert texture._groups([*two, ("c", 10.0), ("c", 10.2)]) == (["0", "1", "0", "1", "0", "1"], "a repetition")


def test_a_specimen_of_options():
    finger = Finger.default()
    assert SpecimenOptions("block", None, None).of(0.5, finger) == finger.bench.specimen(0.5)
    assert SpecimenOptions("block", 3.0, None).of(0.5, finger).thickness == 3.0
    assert SpecimenOptions("sphere", None, 4.0).of(0.5, finger).radius == 4.0
    assert SpecimenOptions("half-space", None, None).of(0.5, finger).modulus == 0.5
    for options, said in [
        (("block", None, 4.0), "--radius is for a sphere, not for a block"),
        (("sphere", 3.0, 4.0), "--thickness is for a block, not for a sphere"),
        (("sphere", None, None), "a sphere needs --radius"),
    ]:
        with pytest.raises(InputError, match=said):
            SpecimenOptions(*options).of(0.5, finger)


def test_json_has_no_nan_and_text_no_control_characters():
    text = output.json_text({"a": (1.0, math.nan), "b": {"c": math.inf}, "d": "\x85µ"})
    assert json.loads(text) == {"a": [1.0, None], "b": {"c": None}, "d": "\x85µ"} and "\x85" not in text
    assert output.plain("a\n\tb\x1b[2J") == "a b\\x1b[2J"
    cut = output.plain("x" * 2500)
    assert cut.startswith("x" * 1000 + " ... (500 characters) ... ") and len(cut) < 2100


def test_a_held_parameter_is_a_name_and_a_number():
    assert identify._held(["lever_mm = 0.5", "gain.g1=1"]) == {"lever_mm": 0.5, "gain.g1": 1.0}
    for text, said in [("lever_mm", "--fix takes NAME=VALUE, got 'lever_mm'"), ("lever_mm=x", "must be a number")]:
        with pytest.raises(InputError, match=said):
            identify._held([text])


@pytest.mark.parametrize("speed, first", [(20.0, 12.0), (-20.0, 58.0)])
def test_a_motion_on_a_profile_begins_inside_it(speed, first):
    profile = MeasuredProfile(np.linspace(10.0, 60.0, 51), np.zeros(51))
    moved = slide.MotionOptions(speed, None, 0.5, 1000.0).moved(profile, 2.0)
    assert moved.position_mm[0] == pytest.approx(first) and np.sign(np.diff(moved.position_mm)).mean() == np.sign(speed)
    with pytest.raises(InputError, match="--speed needs --seconds"):
        slide.MotionOptions(speed, None, None, 1000.0).moved(profile, 2.0)


def test_a_slide_is_written_with_null_for_what_is_not_finite(tmp_path):
    time = np.arange(3) / 1000
    found = SimpleNamespace(
        amplified=np.arange(6.0).reshape(3, 2), force_N=np.full(3, 0.3), tangential_N=np.zeros(3),
        motion=SimpleNamespace(t_s=time, velocity_mm_s=np.ones(3), position_mm=time),
    )  # fmt: skip
    slide._write(tmp_path / "l.csv", tmp_path / "t.json", found, 0.0, 1, {"a": math.nan, "b": 2.5, "c": math.inf})
    assert json.loads((tmp_path / "t.json").read_text()) == {"a": None, "b": 2.5, "c": None}
    log = read_time_log(tmp_path / "l.csv")
    assert log.readings.tolist() == [[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]] and log.force_N.tolist() == [0.3] * 3


def test_a_touch_over_time_is_air_loading_and_hold(tmp_path):
    def pressed(force: float) -> SimpleNamespace:
        return SimpleNamespace(force=force, indentation=2 * force, reading=np.array([100 * force, -50 * force]))

    press.write_touch_log(tmp_path / "touch.csv", pressed(0.5), pressed, lambda _: None)
    log = read_time_log(tmp_path / "touch.csv")
    assert len(log) == 1200 and log.sample_rate_Hz == pytest.approx(1000.0)
    assert not log.force_N[:200].any() and not log.readings[:200].any()
    assert log.force_N[450] == pytest.approx(0.25) and log.force_N[705:].tolist() == [0.5] * 495
    assert log.readings == pytest.approx(np.outer(log.force_N, [100.0, -50.0]))
    assert log.force_N[log.force_N > 0].min() >= press.LIGHTEST_N


def test_a_run_over_a_texture_has_its_speed_place_and_readings(tmp_path):
    time = np.arange(500) / 1000
    table = np.column_stack([time, np.sin(time), 20 * time])
    np.savetxt(tmp_path / "l.csv", table, delimiter=",", header="t_s,g1,position_mm", comments="")
    speed, place, readings = texture._run(tmp_path / "l.csv", None)
    assert speed == pytest.approx(20.0) and place == pytest.approx(20 * time) and readings.shape == (500, 1)


def test_a_display_is_a_model_and_what_it_is():
    options = {"components": 2, "actuator": "piezo", "stroke_um": None, "rule": "measured", "curve": None}
    model, described = telepresence_options.DisplayOptions(**options).model()
    assert isinstance(model, LocalModel) and described["amplitude"] == {"rule": "measured"}
    assert described["stroke_um"] == model.actuator.stroke_um == 55.0
    own, said = telepresence_options.DisplayOptions(**options | {"actuator": "icpf", "stroke_um": 80.0}).model()
    assert own.actuator.stroke_um == said["stroke_um"] == 80.0
    by_curve, said = telepresence_options.DisplayOptions(**options | {"rule": "g_A"}).model()
    assert said["amplitude"]["rule"] == "g_A" and 0 < said["amplitude"]["r_squared"] <= 1
