"""The summary of `papilla estimate`, from rows, codes and lines that are made up."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.calibration.readouts import SoftnessStatus
from papilla.cli import estimate, estimate_summary
from papilla.cli.estimate_summary import Summary
from papilla.core.errors import InputError
from papilla.estimators.pipeline import PipelineEstimate
from papilla.logs.time_log import LogReport
from papilla.model.finger import Finger

REPORT = LogReport(6, 2, 1, 4, 3, 0, ("a note of the log",))
LEGEND = {
    "modulus": {"no contact": "the finger touches nothing", "ok": "ok"},
    "wavelength": {"searching": "not enough path", "ok": "ok", "frequency alone": "no path"},
    "friction": {"one way": "slide both ways", "ok": "ok"},
}


def summary_of(optional=("force_N",), off=None, faults=None, messages=(), report=REPORT) -> Summary:
    log = SimpleNamespace(
        gauge_names=("g1", "g2"), optional=optional, report=report, sample_rate_Hz=1000.0, path="l.csv"
    )
    pipeline = SimpleNamespace(off=off or {}, faults=faults or {}, messages=messages, legend=LEGEND)
    return Summary(log, pipeline)


def answer(modulus, wavelength, friction, **values) -> PipelineEstimate:
    """Answers of some rows by their codes; values are NaN unless they are given."""
    count = len(modulus)
    found = {name: np.full(count, math.nan) for name in PipelineEstimate._fields}
    found |= {name: np.array(column, float) for name, column in values.items()}
    found |= {"modulus_status": modulus, "wavelength_status": wavelength, "friction_status": friction}
    return PipelineEstimate(**found)


def block(count: int, first: float = 0.0, columns: int = 4) -> np.ndarray:
    rows = np.zeros((count, columns))
    rows[:, 0] = first + np.arange(count)
    return rows


def test_counts_last_answers_and_worst_codes():
    one = summary_of(off={"friction": "no column tangential_N, velocity_mm_s"}, messages=("a message",))
    worst = one.add(block(3), answer(
        ["ok", "no contact", "ok"], ["ok, constant speed", "ok", "searching"], ["no column tangential_N"] * 3,
        modulus_MPa=[0.5, 0.6, 0.7], modulus_sigma_MPa=[0.1, 0.2, 0.3], wavelength_mm=[1.5, 1.6, 1.7],
        wavelength_sigma_mm=[0.1, 0.2, 0.3], frequency_Hz=[10.0, 20.0, 30.0],
    ))  # fmt: skip
    assert worst == ["no column tangential_N", "no contact", "searching"]
    worst = one.add(block(3, 3.0), answer(
        ["ok"] * 3, ["frequency alone", "ok", "ok"], ["ok", "ok", "one way"],
        modulus_MPa=[math.nan, 0.8, math.nan], frequency_Hz=[40.0, math.nan, math.nan],
    ))  # fmt: skip
    assert worst == ["frequency alone", "ok", "one way"] and one.rows == 6
    found = one.finish(None)
    assert found["rows"] == 6 and found["ok_rows"] == {"modulus": 5, "frequency": 5, "wavelength": 4, "friction": 2}
    assert found["answered_rows"] == {"modulus_MPa": 4, "frequency_Hz": 4, "wavelength_mm": 3, "mu_kinetic": 0}
    assert found["last_answer"]["t_s"] == 4.0 and found["last_answer"]["modulus_MPa"] == 0.8
    assert found["last_frequency"] == {"t_s": 3.0, "frequency_Hz": 40.0}
    assert found["last_wavelength"] == {"t_s": 1.0, "wavelength_mm": 1.6, "wavelength_sigma_mm": 0.2}
    assert found["last_friction"] is None and (found["lines"], found["searched_mm"]) == ([], None)
    assert found["status"] == {
        "no column tangential_N": 1, "no contact": 1, "searching": 1, "frequency alone": 1, "ok": 1, "one way": 1,
    }  # fmt: skip
    assert found["statuses"]["modulus"] == {"ok": 5, "no contact": 1}
    assert found["statuses"]["frequency"] == found["statuses"]["wavelength"]
    facts = {name: found[name] for name in ("nan_rows", "nan_cells", "gaps", "duplicates", "sample_rate_Hz")}
    assert facts == {"nan_rows": 3, "nan_cells": 4, "gaps": 2, "duplicates": 1, "sample_rate_Hz": 1000.0}
    speed = "wavelength: 1 of the 4 ok rows are of a constant speed"
    assert found["messages"][0].startswith(speed) and found["messages"][1:] == ["a message", "a note of the log"]
    assert found["remarks"] == 1


def test_a_quantity_without_an_ok_row_has_its_reason_and_advice():
    one = summary_of(off={"friction": "no column tangential_N"}, faults={"g1 stuck": 3, "g2, a gauge": 4, "a gap": 5},
                     messages=("modulus: the calibration is in doubt: changed", "another"))  # fmt: skip
    one.add(block(3), answer(["no contact"] * 3, ["searching"] * 3, ["no column tangential_N"] * 3))
    first, modulus, wavelength, gauges, *rest = one.finish(None)["messages"]
    assert first == "modulus: the calibration is in doubt: changed"
    assert modulus.startswith("modulus: no row is ok, most often because: the finger touches nothing. To do: state the")
    assert wavelength.startswith("wavelength: no row is ok, most often because: not enough path. To do: slide over a")
    assert gauges.startswith("gauges: g1 stuck in 3 rows, g2, a gauge in 4 rows. To do: look at their wiring")
    assert rest == ["another", "a note of the log"] and one.finish(None)["remarks"] == 4
    many = summary_of(faults={f"g1 fault {k}": k for k in range(6)})
    assert many._broken()[0].count(" rows") == 4


def test_a_fault_is_worse_than_what_the_log_lacks_and_that_worse_than_a_remark():
    one = summary_of(off={"modulus": "no calibration, and no force"})
    codes = (["no calibration"] * 3, ["searching", "ok, constant speed", "ok"], ["ok", "ok", "one way"])
    assert one.add(block(3), answer(*codes)) == ["searching", "no calibration", "one way"]
    assert one.add(block(2), answer(["ok"] * 2, ["ok", "ok, constant speed"], ["ok, x", "ok"])) == [
        "ok, x", "ok, constant speed",
    ]  # fmt: skip


def test_numbers_in_another_unit_are_an_error_if_no_row_is_ok():
    report = LogReport(3, 0, 0, 0, 0, 0, (), ("t_s looks like ms",))
    for codes, refused in ((["searching"] * 3, True), (["searching", "frequency alone", "searching"], False)):
        one = summary_of(report=report)
        one.add(block(3), answer(["no contact"] * 3, codes, ["one way"] * 3))
        if refused:
            with pytest.raises(InputError, match=r"^l\.csv: no row has an answer that is ok; t_s looks like ms"):
                one.check()
        else:
            one.check()
            assert "t_s looks like ms" in one.finish(None)["messages"]
    one = summary_of()
    one.add(block(3), answer(["no contact"] * 3, ["searching"] * 3, ["one way"] * 3))
    one.check()


@pytest.mark.parametrize("moving", ["velocity_mm_s", "position_mm"])
def test_lines_are_of_the_latest_rows_and_count_the_rows_that_agree(monkeypatch, moving):
    from papilla.estimators.wavelength import lines

    asked = {}
    made = [
        SimpleNamespace(wavelength_mm=1.5, sigma_mm=0.01, amplitude=3.0, ratio=40.0, chance=1e-6, harmonic=1,
                        fundamental_mm=1.5, channels=[1, 0]),
        SimpleNamespace(wavelength_mm=0.75, sigma_mm=0.02, amplitude=2.0, ratio=20.0, chance=1e-3, harmonic=2,
                        fundamental_mm=1.5, channels=[0]),
        SimpleNamespace(wavelength_mm=4.0, sigma_mm=0.02, amplitude=1.0, ratio=20.0, chance=1e-3, harmonic=1,
                        fundamental_mm=4.0, channels=[0]),
    ]  # fmt: skip
    spectrum = SimpleNamespace(lines=made, searched_mm=(0.5, 9.0))

    def find_lines(place, readings, wavelength_range_mm):
        asked.update(place=place, readings=readings, range=wavelength_range_mm)
        return spectrum

    monkeypatch.setattr(lines, "find_lines", find_lines)
    monkeypatch.setattr(lines, "latest_stretch", lambda place, wavelengths: 0)
    monkeypatch.setattr(estimate_summary, "LONGEST_ROWS", 4)
    one = summary_of(optional=("force_N", moving))
    # In steps of 2 % of the logarithm: the step of 1.5 mm, from 0.39 to 0.41, and both beside it agree
    near = [1.5, math.exp(0.4285), math.exp(0.3715), math.exp(0.3685)]
    for first in (0, 2, 4):
        rows = block(2, first, 5)
        rows[:, 1:3] = [[10 + first, 20], [11 + first, 21]]
        rows[:, 4] = 5.0 if moving == "velocity_mm_s" else 5.0 * rows[:, 0]
        codes = ["ok" if first < 4 else "searching"] * 2
        one.add(rows, answer(["ok"] * 2, codes, ["ok"] * 2, wavelength_mm=near[first : first + 2] or [1.5, 1.5]))
    found = one.finish((1.0, 5.0))
    assert asked["readings"].tolist() == [[12, 20], [13, 21], [14, 20], [15, 21]] and asked["range"] == (1.0, 5.0)
    # A velocity counts from the first row that is kept
    begin = 0.0 if moving == "velocity_mm_s" else 10.0
    assert np.diff(asked["place"]) == pytest.approx([5.0] * 3) and asked["place"][-1] - 15.0 == pytest.approx(
        begin, abs=5.1
    )
    assert found["lines"][0] == {
        "wavelength_mm": 1.5, "wavelength_sigma_mm": 0.01, "strength": 3.0, "power_over_background": 40.0,
        "chance": 1e-6, "harmonic": 1, "fundamental_mm": 1.5, "gauges": ["g2", "g1"], "ok_rows": 3,
    }  # fmt: skip
    assert [line["ok_rows"] for line in found["lines"]] == [3, 3, 0] and found["searched_mm"] == [0.5, 9.0]
    assert one.spectrum is spectrum
    doubt, latest = [text for text in found["messages"] if text.startswith("lines:")]
    assert "1 of the whole log, the strongest 4 mm, are ok in no row" in doubt
    assert latest == "lines: of the log from 2 s on; a longer path is not searched at once"


def test_no_more_rows_are_kept_than_lines_need(monkeypatch):
    monkeypatch.setattr(estimate_summary, "LONGEST_ROWS", 10)
    one = summary_of(optional=("position_mm",))
    kept = []
    for first in range(0, 24, 4):
        one.add(block(4, first), answer(["ok"] * 4, ["searching"] * 4, ["ok"] * 4))
        kept.append(sum(map(len, one._tail)))
    assert kept == [4, 8, 12, 12, 12, 12]


def told(tmp_path, **changes) -> dict:
    quantities = ("modulus", "frequency", "wavelength", "friction")
    found = {key: None for key in estimate_summary.LAST}
    found |= {"rows": 200, "ok_rows": dict.fromkeys(quantities, 100), "lines": [], "sample_rate_Hz": 1000.0}
    found |= {"statuses": {name: {"ok": 100, "no contact": 100} for name in quantities}, "nan_rows": 1, "gaps": 2}
    found |= {"duplicates": 3, "force_noise_N": None, "gauge_noise_microstrain": None, "legend": LEGEND}
    found |= {"messages": ["one", "two", "three", "four", "five", "a note"], "remarks": 5, "estimates": "e.csv"}
    return found | {"summary": str(tmp_path / "e.summary.json"), "log": "log.csv"} | changes


def test_a_summary_is_a_file_a_table_and_three_remarks(tmp_path, capsys):
    summary = told(tmp_path)
    estimate_summary.show(summary, ["of the log"], False)
    captured = capsys.readouterr()
    assert captured.err.splitlines() == ["of the log", "one", "two", "three", f"2 more remarks in {summary['summary']}"]
    assert json.loads((tmp_path / "e.summary.json").read_text()) == json.loads(json.dumps(summary))
    assert "200 rows at 1000 Hz; 1 rows without a number in a cell, 2 gaps, 3 repeated times" in captured.out
    assert "  modulus, no contact: the finger touches nothing".strip() in captured.out
    assert captured.out.endswith(f"Wrote e.csv, and this summary in full: {summary['summary']}\n")
    estimate_summary.show(summary, [], True)
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(summary))


def test_beside_estimates_on_standard_output_nothing_but_words_is_said(tmp_path, capsys):
    estimate_summary.show(told(tmp_path, summary=None, remarks=3), [], False)
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.splitlines()[-3:] == ["one", "two", "three"]
    assert "modulus, no contact: the finger touches nothing" in captured.err and not list(tmp_path.iterdir())
    estimate_summary.show(told(tmp_path, summary=None, remarks=4), [], False)
    assert capsys.readouterr().err.splitlines()[-1] == "1 more remarks"
    estimate_summary.show(told(tmp_path, summary=None, remarks=1), [], False)
    assert capsys.readouterr().err.splitlines()[-1] == "one"


@pytest.mark.parametrize("answered", [True, False])
def test_a_page_and_a_picture_have_the_answers_as_title(tmp_path, monkeypatch, answered):
    from matplotlib.figure import Figure

    asked = []
    picture = SimpleNamespace(figure=lambda *given: asked.append(given) or Figure())
    last = {"modulus_MPa": 0.5, "modulus_sigma_MPa": 0.1, "t_s": 1.0}
    summary = told(tmp_path, log="folder/log.csv", **{"last_answer": last} if answered else {})
    plot, page = tmp_path / "p.svg", tmp_path / "p.html"
    estimate_summary.write_pictures(summary, ["of the log"], picture, "spectrum", plot, page)
    title = "modulus 0.5 MPa (0.304 to 0.696)" if answered else "no row has an answer that is ok"
    assert asked == [("log.csv", title, "spectrum")] and plot.read_bytes().startswith(b"<?xml")
    text = page.read_text()
    for part in ("of the log", "one", "three", "200 rows at 1000 Hz", "the finger touches nothing", "no contact 50 %"):
        assert part in text, part
    assert "four" not in text
    plot.unlink()
    estimate_summary.write_pictures(summary, [], picture, None, None, None)
    assert not plot.exists()


# ---- What the estimators are given


def test_zeros_of_a_calibrations_bench_are_numbers_for_its_gauges():
    made = lambda zeros: SimpleNamespace(finger={"zeros_microstrain": zeros}, gauges=[1, 2])  # noqa: E731
    assert estimate._zeros(made([1.5, -2])).tolist() == [1.5, -2.0]
    assert estimate._zeros(None).size == 0 and estimate._zeros(SimpleNamespace(finger={}, gauges=[1])).size == 0
    for zeros in ([1.0], [1.0, True], "12", [1.0, "2"]):
        with pytest.raises(InputError, match="finger.zeros_microstrain must hold 2 numbers"):
            estimate._zeros(made(zeros))


def test_noise_is_that_of_the_worst_gauge_and_not_below_a_floor():
    log = lambda **noise: SimpleNamespace(gauge_names=("g1", "g2"), noise=noise)  # noqa: E731
    assert estimate._noise(log(g1=2.0, g2=3.0, force_N=0.01)) == {"gauge_sigma": 3.0, "force_sigma_N": 0.01}
    floor = {"gauge_sigma": 0.1, "force_sigma_N": 1e-4}
    assert estimate._noise(log(g1=0.01, g2=math.nan, force_N=1e-6)) == floor
    assert estimate._noise(log(g1=math.nan, g2=math.nan, force_N=math.nan)) == floor == estimate._noise(log(g1=0, g2=0))


def test_options_of_the_estimators_reach_the_pipeline(monkeypatch):
    import papilla.estimators

    asked = []
    monkeypatch.setattr(papilla.estimators, "Pipeline", lambda record, **how: asked.append((record, how)) or "pipeline")
    log = SimpleNamespace(gauge_names=("g1",), optional=("force_N", "indentation_mm"), sample_rate_Hz=500.0)
    plain = dict.fromkeys(("finger", "wavelength_range", "saturation", "thickness", "friction_memory"))
    noise = {"gauge_sigma": 2.0}
    made = lambda **how: estimate.EstimatorOptions(**plain | {"softness": "gauges"} | how)  # noqa: E731
    assert made().pipeline("record", log, noise) == "pipeline"
    always = {"gauges": ("g1",), "columns": ("force_N",), "sample_rate_Hz": 500.0, "gauge_sigma": 2.0}
    assert asked[0] == ("record", always | {"softness": "gauges"}), "without a design no ridges are known"
    made(wavelength_range=(1.0, 2.0), saturation=100.0, friction_memory=5.0, thickness=7.0, softness="sd").pipeline(
        "record", log, noise
    )
    doubts = asked[1][1].pop("doubts")
    more = {"wavelength_range_mm": (1.0, 2.0), "saturation": 100.0, "friction_memory_mm": 5.0, "softness": "sd"}
    assert asked[1] == ("record", always | more) and doubts.thickness_mm == 7.0
    made(softness="force-depth").pipeline("record", log, noise)
    assert asked[2] == (None, always)
    made(finger="default").pipeline("record", log, noise)
    assert asked[3][1]["ridge_pitch_mm"] == Finger.default().ridge_pitch_mm


def test_reading_a_long_log_is_said_after_each_100_000_rows(monkeypatch):
    import papilla.logs

    said, asked = [], []
    monkeypatch.setattr(papilla.logs, "TimeLogFile", lambda *given, **how: asked.append((given, how)) or "file")
    assert estimate._opened("log.csv", SimpleNamespace(line=said.append), lever_mm=2.0) == "file"
    (path, reading), how = asked[0]
    for rows in (100_000, 100_001, 2_000_000):
        reading(rows)
    assert (path, how) == ("log.csv", {"lever_mm": 2.0})
    assert said == ["reading the log, 100,001 rows", "reading the log, 2,000,000 rows"]


def test_a_picture_collects_all_rows_and_is_written_with_the_summary(papilla, tmp_path, monkeypatch):
    rng = np.random.default_rng(1)
    rows = np.column_stack([np.arange(300) / 1000, rng.normal(0, 2, (300, 2)), np.full(300, 0.5)])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="t_s,g1,g2,force_N", comments="")
    made, asked = [], []

    class Picture:
        def __init__(self, gauges, optional, off):
            self.given, self.rows = (gauges, optional, sorted(off)), 0
            made.append(self)

        def add(self, block, answer):
            self.rows += len(block)
            assert len(answer.modulus_MPa) == len(block)

    monkeypatch.setattr("papilla.view.log_picture.LogPicture", Picture)
    monkeypatch.setattr(estimate_summary, "write_pictures", lambda *given: asked.append(given))
    answer = papilla("estimate", "log.csv", "--out", "e.csv", "--plot", "p.svg", "--json")
    assert answer.code == 0, answer.err
    (one,) = made
    assert one.given == (("g1", "g2"), ("force_N",), ["friction", "modulus", "wavelength"]) and one.rows == 300
    ((found, notes, picture, spectrum, plot, html),) = asked
    assert picture is one and (str(plot), html, spectrum) == ("p.svg", None, None) and not notes
    told = json.loads(answer.out)
    assert told["rows"] == found["rows"] == 300 and (told["log"], told["estimates"]) == ("log.csv", "e.csv")
    assert told["summary"] == "e.summary.json" and told["gauge_noise_microstrain"] is None is told["force_noise_N"]
    assert papilla("estimate", "log.csv", "--out", "e.csv", "--html", "p.html").code == 0
    assert str(asked[1][5]) == "p.html" and asked[1][4] is None
    assert papilla("estimate", "log.csv", "--out", "e.csv").code == 0 and len(made) == len(asked) == 2
    said = papilla("estimate", "log.csv", "--out", "-", "--json")
    assert said.code == 2 and "--out - and --json both want standard output" in said.err


def test_the_errors_of_a_depth_are_those_of_the_log_and_not_below_a_floor(tmp_path, monkeypatch):
    from papilla_papers.methods import force_depth

    floor, asked = force_depth.DepthErrors(), []
    rows = np.array([[f, e, 1.0, 0.5 * f / e] for f in (0.1, 0.2, 0.4) for e in (0.1, 0.2, 0.4)])
    header = "force_N,modulus_MPa,g1,indentation_mm"
    np.savetxt(tmp_path / "sweep.csv", rows, delimiter=",", header=header, comments="")
    status = SoftnessStatus.OK

    class Model:
        def __init__(self, *given):
            self.given = given

        errors_of = force_depth.ForceDepth.errors_of

        def process(self, force, depth, errors):
            asked.append((force.tolist(), depth.tolist(), errors))
            return force + 1, depth + 2, [status] * len(force)

    monkeypatch.setattr(force_depth, "ForceDepth", Model)
    legend = {"": "none", "old": "an old one"}
    pipeline = SimpleNamespace(legend={"modulus": legend}, off={"modulus": "no calibration", "friction": "none"})
    log = SimpleNamespace(
        gauge_names=("g1", "g2"), optional=("velocity_mm_s", "force_N", "indentation_mm"),
        noise={"indentation_mm": 10 * floor.depth_mm, "force_N": 0.1 * floor.force_N},
    )  # fmt: skip
    one = estimate.DepthModulus(tmp_path / "calibration.json", log, pipeline)
    assert [part.tolist() for part in one._model.given] == rows.T[[0, 1, 3]].tolist() and list(pipeline.off) == [
        "friction"
    ]
    given = answer(["", ""], ["ok"] * 2, ["ok"] * 2)
    found = one.added(np.arange(12.0).reshape(2, 6), given)
    ((force, depth, errors),) = asked
    assert (force, depth) == ([4.0, 10.0], [5.0, 11.0])
    assert (errors.depth_mm, errors.force_N) == (10 * floor.depth_mm, floor.force_N)
    assert found.modulus_MPa.tolist() == [5.0, 11.0] and found.modulus_sigma_MPa.tolist() == [7.0, 13.0]
    assert found.modulus_status == ["ok", "ok"] and legend == {"old": "an old one", "ok": "ok"}
    assert found.wavelength_status == ["ok", "ok"]
    log.optional = ("indentation_mm",)
    with pytest.raises(InputError, match=r"needs --calibration with its sweep\.csv, and force_N in the log"):
        estimate.DepthModulus(tmp_path / "calibration.json", log, pipeline)
    np.savetxt(tmp_path / "sweep.csv", rows[:, :3], delimiter=",", header=header.rpartition(",")[0], comments="")
    log.optional = ("force_N", "indentation_mm")
    with pytest.raises(InputError, match=r"sweep\.csv has no column indentation_mm"):
        estimate.DepthModulus(tmp_path / "calibration.json", log, pipeline)
