"""What public objects show of themselves, and what they say where they are misused."""

import sys

import numpy as np
import pytest
from made_up_sweep import make_sweep

import papilla
from papilla.calibration import SoftnessStatus, fit, sweep
from papilla.core.errors import FileFormatError, InputError
from papilla.estimators import Pipeline
from papilla.model.finger import DEFAULT_FINGER

SWEEP = make_sweep(np.geomspace(0.02, 5, 12), np.geomspace(0.05, 1, 12))


def test_dir_shows_the_interface_and_nothing_else():
    assert set(dir(papilla)) == set(papilla.__all__)
    assert not [name for name in dir(papilla.fem) if name.startswith("_")]


def test_a_finger_in_place_of_a_reduced_one_gets_a_sentence():
    finger = papilla.Finger.default()
    for call in (lambda: papilla.fem.press(finger, papilla.Block(0.5, 10), force=1), lambda: sweep(finger)):
        with pytest.raises(InputError, match=r"got a Finger: papilla.fem.prepare\(finger\) makes one"):
            call()


def test_a_status_prints_its_name_and_stays_a_number():
    status = SoftnessStatus.HARDER
    assert (str(status), f"{status}", f"{status:d}") == ("HARDER", "HARDER", str(int(status)))
    assert status == int(status)


def test_a_pipeline_and_its_answer_take_a_few_lines():
    pipeline = Pipeline(fit(SWEEP), gauges=5, columns=("force_N", "position_mm"))
    assert repr(pipeline).startswith(
        "Pipeline(t_s, g1, g2, g3, g4, g5, force_N, position_mm; gives modulus, wavelength"
    )
    assert "no friction: no column tangential_N" in repr(pipeline)
    block = np.zeros((40, 8))
    block[:, 0] = np.arange(40) / 1000
    found = repr(pipeline.process(block))
    assert found.startswith("PipelineEstimate(40 rows, the last: modulus nan") and found.count("\n") == 2
    assert repr(pipeline.update(tuple([0.041] + 7 * [0.0]))).startswith("PipelineEstimate(modulus nan")
    assert repr(pipeline.process(np.zeros((0, 8)))) == "PipelineEstimate(no rows)"


def test_tables_for_notebooks_hold_the_numbers_and_escape_names():
    from dataclasses import replace

    finger = replace(papilla.Finger.default(), name="<mine>")
    assert "&lt;mine&gt;" in finger._repr_html_() and finger._repr_html_().count("<tr>") == 4 + 5
    calibration = fit(SWEEP)
    assert "0.02 to 5" in calibration._repr_html_() and "one sigma of fit" in calibration._repr_html_()
    shown = SWEEP._repr_html_()
    assert shown.count("<tr>") == 6 and f"{SWEEP.sd_microstrain[0]:.5g}" in shown


def test_an_unknown_key_suggests_the_nearest(tmp_path):
    text = DEFAULT_FINGER.read_text(encoding="utf-8")
    (tmp_path / "f.toml").write_text(text.replace("\nmodulus_MPa = 0.136", "\nmodulus_kPa = 136", 1), encoding="utf-8")
    with pytest.raises(FileFormatError, match="f.toml: unknown key outer.modulus_kPa; did you mean modulus_MPa?"):
        papilla.Finger.load(tmp_path / "f.toml")


def test_a_frame_has_the_columns_of_the_file(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    SWEEP.to_csv(tmp_path / "sweep.csv")
    frame = SWEEP.to_frame()
    assert ",".join(frame) == (tmp_path / "sweep.csv").read_text().splitlines()[0]
    made = type("Module", (), {"DataFrame": staticmethod(lambda columns: ("frame", list(columns)))})
    monkeypatch.setitem(sys.modules, "pandas", made)
    assert SWEEP.to_frame() == ("frame", list(frame))
