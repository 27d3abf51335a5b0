"""Tables on a narrow terminal: numbers stay whole, words wrap; and where layouts are fixed."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from papilla.calibration.fitting.checking import Check, CheckedPress
from papilla.cli import calibrate, estimate_summary, output, verify
from papilla.verify.case import Case
from papilla_papers.claims.claim import Answer
from papilla_papers.claims.runner import CLAIMS, EXPERIMENTS, Result
from papilla_papers.cli import reproduce

WORDS = "many words that say at some length what happened here"


@pytest.fixture(autouse=True)
def narrow(monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")


def lines(capsys) -> list[str]:
    return capsys.readouterr().out.splitlines()


def test_cases_of_verify_wrap_words_alone(capsys):
    case = SimpleNamespace(what=WORDS, cause=WORDS, value=2e-3, bound=1e-2, passed=False, seconds=123.45)
    verify._print([case])
    *table, last = lines(capsys)
    row = next(line for line in table if "2.0e-03" in line)
    cells = [cell.strip() for cell in row.split("│")[1:-1]]
    assert cells[2:] == ["2.0e-03", "1e-02", "MISSED", "123.5"] and row.split("│")[-2].startswith(" 123.5")
    assert sum("│" in line for line in table) > 3, "the words are wrapped, not cut"
    assert "…" not in "".join(table) and last == "1 cases, 1 outside their bounds, 123 s"
    assert row.split("│")[3].startswith("  2.0e-03") or row.split("│")[3] == " 2.0e-03 "


def test_a_check_of_a_calibration_wraps_its_sentences_alone(capsys):
    one = CheckedPress(0.12345, 0.5, 0.51234, 0.0212, 0.47123, 0.55123, True, WORDS)
    calibrate._print_check(Check((one,), 0.05), "c.csv")
    table = lines(capsys)
    row = next(line for line in table if "0.1235" in line)
    assert [cell.strip() for cell in row.split("│")[1:5]] == ["0.1235", "0.5", "0.5123 ± 0.021", "0.471 to 0.551"]
    assert sum(line.startswith("│") for line in table) > 1 and "…" not in "".join(table)


def test_the_reasons_of_an_estimate_wrap_alone(capsys):
    quantities = ("modulus", "frequency", "wavelength", "friction")
    summary = {key: None for key in estimate_summary.LAST} | {"lines": [], "rows": 200, "legend": {}}
    summary |= {"statuses": {name: {WORDS: 100, f"{WORDS} too": 50} for name in quantities}}
    summary |= {"ok_rows": dict.fromkeys(quantities, 50), "estimates": "e", "summary": "s", "sample_rate_Hz": 1.0}
    summary |= {"nan_rows": 0, "gaps": 0, "duplicates": 0, "force_noise_N": None}
    last = {"modulus_MPa": 0.51234, "modulus_sigma_MPa": 0.1, "t_s": 1.0}
    estimate_summary.print_summary(summary | {"last_answer": last})
    table = lines(capsys)
    row = next(line for line in table if "0.5123 MPa" in line)
    assert "modulus" in row and "0.3163 to 0.7083" in row and "25 %" in row
    assert max(map(len, table)) < 90 and WORDS not in row, "the last column is not as wide as its words"


def test_rows_of_claims_follow_each_other_closely(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "150")
    answer = Answer.untested(CLAIMS[0], EXPERIMENTS[0].name, "no sensor")
    reproduce._print([Result(EXPERIMENTS[0], (answer,) * 13)], ["last"])
    *table, note, last = lines(capsys)
    rows = [line for line in table if line.startswith(f"{CLAIMS[0].key} ")]
    assert len(rows) == 13 and last == "last" and note.startswith("Notes, tolerances and calls")
    assert all(line.strip() for line in table), "no empty lines between rows"
    key = len(CLAIMS[0].key)
    assert rows[0][key : key + 1] == " " != rows[0][key + 1], "one space between columns"


def test_numbers_and_verdicts_stay_whole_where_nothing_fits(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "12")
    letters = " ".join("abcdefghijklmnopqrst")
    case = SimpleNamespace(what=letters, cause=letters, value=2e-3, bound=1e-2, passed=False, seconds=1e8)
    verify._print([case])
    assert any("2.0e-03 │ 1e-02 │ MISSED │ 100000000.0" in line for line in lines(capsys))
    output.show_rows(["name", "1.5 ± 0.25 mm"], [["a long name", "1.25 ± 0.125 N"]])
    assert any("a long name │ 1.25 ± 0.125 N" in line for line in lines(capsys))
    answer = Answer.untested(CLAIMS[0], EXPERIMENTS[0].name, "no sensor")
    reproduce._print([Result(EXPERIMENTS[0], (answer,) * 13)], [])
    assert sum("not testable here" in line for line in lines(capsys)) == 13
    claim = replace(CLAIMS[0], published=letters, unit=letters, source=letters, claim=letters)
    case = Case("", "", 123456.0, (0.0, 1.0))
    reproduce._print([Result(EXPERIMENTS[0], (Answer(claim, "x", case),) * 13)], [])
    assert sum(" 1.235e+05 " in line for line in lines(capsys)) == 13


def test_published_words_and_units_are_folded_at_14_letters(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "150")
    claim = replace(CLAIMS[0], published="p" * 15, unit="u" * 15)
    reproduce._print([Result(EXPERIMENTS[0], (Answer.untested(claim, "x", "no sensor"),))], [])
    said = " ".join(" ".join(lines(capsys)).split())
    assert f" {'p' * 14} – {'u' * 14} not testable here" in said and "p" * 15 not in said and "u" * 15 not in said


def test_a_stage_is_said_again_after_five_seconds(monkeypatch, capsys):
    now = iter([100.0, 104.9, 105.0, 109.9, 110.0])
    monkeypatch.setattr(output.time, "monotonic", lambda: next(now))
    shown = output.Progress(None)
    for number in range(5):
        shown.line(f"meshing, {number}")
    assert capsys.readouterr().err.splitlines() == ["meshing, 0", "meshing, 2", "meshing, 4"]


def test_lines_are_searched_in_nine_minutes_at_1_kHz():
    minutes = estimate_summary.LONGEST_ROWS / 1000 / 60
    assert minutes == pytest.approx(8.738, abs=1e-3)
