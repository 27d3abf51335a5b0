"""What `papilla identify` asks of the fit, and what it makes of it: JSON, files and words; the fit is made up."""

import json
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.cli import identify
from papilla.cli.identify import SuggestOptions
from papilla.cli.options import PROCESSES
from papilla.core.errors import InputError
from papilla.identification import Noise
from papilla.model.finger import Finger
from papilla.model.specimen import Block

LOG = "force_N,modulus_MPa,g1,g2\n0.2,0.5,1,2\n0.3,0.1,2,3\n0.4,0.5,3,4\n"


@dataclass(frozen=True)
class Kept:
    """What a design keeps of an identification."""

    of_what: str
    relaxation_times_s: tuple = ()


class Found(SimpleNamespace):
    """An identification with a free and a held parameter."""

    def __getitem__(self, name):
        return self.values[name], 0.05

    def with_record(self, kept):
        self.kept = kept
        return Finger.default()


def found_of(log) -> Found:
    shape = SimpleNamespace(specimen=Block(1.0, 7.0), friction="not told", physics="block 7 mm thick")
    noise = Noise(4.0, 0.02)
    problem = SimpleNamespace(log=log, noise=noise, shapes=[shape])
    values = {"outer_modulus_MPa": 0.2, "lever_mm": 0.5}
    return Found(problem=problem, values=values, names=("outer_modulus_MPa",), chi_square=12.0, freedom=10.0)


@pytest.fixture
def fitted(monkeypatch, tmp_path):
    """What the fit, and what follows it, were asked for."""
    from papilla import identification
    from papilla.identification import one_touch, suggest
    from papilla.identification import page as identification_page

    (tmp_path / "log.csv").write_text(LOG)
    (tmp_path / "log.csv").chmod(0o444)
    asked = SimpleNamespace(presses=None, design=None, how=None, page=None, suggested=[], touch=None)
    diagnosis = SimpleNamespace(
        intervals={"outer_modulus_MPa": (0.1, 0.3)}, status="fine", condition=3.0, influence=np.array([0.5, 0.25, 0.1]),
        profiles=[SimpleNamespace(name="outer_modulus_MPa", lower=0.1)], doubts=("a doubt",),
    )  # fmt: skip

    def fit(presses, design, **how):
        asked.presses, asked.design, asked.how = presses, design, how
        asked.found = found_of(presses)
        return asked.found

    def suggested(known, count, moduli, **how):
        asked.suggested.append((known, count, moduli, how))
        return suggest.Suggestion((0.25, 0.5), (0.5, 0.1), ((0.0, 0.0), (3.0, 0.0)), 1.5, 0.125, how["criterion"])

    def touched(found, log, terms):
        asked.touch = (found, log, terms)
        told = {"by": "g1", "modulus_MPa": 0.5, "terms": [], "doubts": []}
        return SimpleNamespace(to_json=lambda: told, recorded={"relaxation_times_s": (3.0,)})

    monkeypatch.setattr(identification, "identify", fit)
    monkeypatch.setattr(identification, "diagnose", lambda found: diagnosis)
    monkeypatch.setattr(identification, "record", lambda found, diagnosis, of_what: Kept(of_what))
    monkeypatch.setattr(suggest, "suggest_presses", suggested)
    monkeypatch.setattr(one_touch, "fit_touch", touched)
    page = lambda path, found, told: path.write_text(told.status)  # noqa: E731
    monkeypatch.setattr(identification_page, "write_identification", page)
    return asked


def test_the_options_of_an_identification_reach_the_fit(papilla, fitted, tmp_path):
    options = (
        "--fix",
        "lever_mm=0.5",
        "--fix",
        "gain.g1 = 2",
        "--free",
        "thickness_mm",
        "--noise",
        3,
        "--thickness",
        7,
    )
    files = ("--out", "f.toml", "--report", "r.html")
    scene = ("--force-error", 0.05, "--friction", "stick", "--finger", "published")
    answer = papilla("identify", "log.csv", *options, *scene, *files, "--json")
    assert answer.code == 0, answer.err
    how = fitted.how
    assert fitted.presses.force_N.tolist() == [0.2, 0.3, 0.4] and fitted.design == Finger.load("published")
    assert (how["free"], how["fix"]) == (["thickness_mm"], {"lever_mm": 0.5, "gain.g1": 2.0})
    assert (how["noise"], how["friction"], how["processes"]) == (Noise(3.0, 0.05), "stick", PROCESSES)
    assert (how["specimen"].thickness, how["specimen"].modulus) == (7.0, 1.0)
    found = json.loads(answer.out)
    assert found["parameters"] == {
        "outer_modulus_MPa": {"value": 0.2, "free": True, "sigma": 0.05, "lower": 0.1, "upper": 0.3},
        "lever_mm": {"value": 0.5, "free": False},
    }
    expected = {
        "presses": 3, "status": "fine", "chi_square": 12.0, "freedom": 10.0, "condition": 3.0, "friction": "not told",
        "physics": "block 7 mm thick", "influence": [0.5, 0.25, 0.1], "doubts": ["a doubt"], "finger": "f.toml",
        "report": "r.html", "profiles": [{"name": "outer_modulus_MPa", "lower": 0.1}],
    }  # fmt: skip
    assert {name: found[name] for name in expected} == expected
    assert found["noise"]["readings_microstrain"] == 4.0 and found["noise"]["words"] == Noise(4.0, 0.02).words
    assert (found["specimen"]["kind"], found["specimen"]["thickness_mm"]) == ("block", 7.0)
    assert not {"suggested", "relaxation", "loops"} & {*found} and fitted.suggested == []
    assert fitted.found.kept == Kept("block 7 mm thick")
    assert Finger.load(tmp_path / "f.toml").gauges == Finger.default().gauges
    assert (tmp_path / "r.html").read_text() == "fine"


def test_an_identification_has_its_default_noise_and_finger(papilla, fitted):
    answer = papilla("identify", "log.csv", "--out", "f.toml")
    assert answer.code == 0 and fitted.design == Finger.default() and fitted.how["noise"] == Noise(5.0, 0.01)
    assert (fitted.how["free"], fitted.how["fix"], fitted.how["friction"]) == ((), {}, None)
    assert fitted.how["specimen"] == Finger.default().bench.specimen(1.0)
    said = " ".join(answer.out.replace("│", " ").split())
    assert "3 presses on: block 7 mm thick Values and 95 % intervals:" in said
    assert "outer_modulus_MPa 0.2 MPa 0.1 to 0.3" in said and "lever_mm 0.5 mm held" in said
    assert said.endswith(f"Noise: {Noise(4.0, 0.02).words}. Status: fine. Doubt: a doubt. Wrote f.toml")


def test_a_report_alone_is_written(papilla, fitted, tmp_path):
    answer = papilla("identify", "log.csv", "--report", "r.html", "--suggest", 1, "--json")
    assert answer.code == 0 and (tmp_path / "r.html").read_text() == "fine"
    assert "finger" not in json.loads(answer.out) and not (tmp_path / "f.toml").exists()


def test_the_next_presses_are_on_the_specimens_of_the_log_unless_others_are_given(papilla, fitted):
    answer = papilla("identify", "log.csv", "--suggest", 2, "--criterion", "D", "--places", "0,0 3,-1.5")
    known, count, moduli, how = fitted.suggested[0]
    assert (known, count, moduli) == (fitted.found, 2, [0.1, 0.5])
    assert how == {"places": [(0.0, 0.0), (3.0, -1.5)], "criterion": "D"}
    said = " ".join(answer.out.replace("│", " ").split())
    assert "Press next:" in said and "press 1 0.25 N on 0.5 MPa at 0, 0 mm" in said
    assert "press 2 0.5 N on 0.1 MPa at 3, 0 mm" in said
    assert "E uncertain by 12 % over 20-100 gf and 0.05-0.72 MPa, now more than a factor of two." in said
    papilla("identify", "log.csv", "--suggest", 1, "--moduli", "2,0.3")
    assert fitted.suggested[1][1:3] == (1, [2.0, 0.3]) and fitted.suggested[1][3]["places"] == [(0.0, 0.0)]


def test_a_protocol_without_a_log_is_of_the_design(papilla, fitted):
    answer = papilla("identify", "--suggest", 2, "--moduli", "0.1,0.5", "--noise", 3, "--thickness", 7, "--json")
    known, count, moduli, how = fitted.suggested[0]
    assert (known, count, moduli) == (Finger.default(), 2, [0.1, 0.5]) and fitted.how is None
    assert how["noise"] == Noise(3.0, 0.01) and how["specimen"].thickness == 7.0 and how["criterion"] == "I"
    found = json.loads(answer.out)
    assert found["finger"] == Finger.default().name and found["criterion"] == "I"
    assert found["suggested"][1] == {"force_N": 0.5, "modulus_MPa": 0.1, "x_mm": 3.0, "y_mm": 0.0}
    assert found["expected_sigma_ln_E"] == {"before": 1.5, "after": 0.125}
    assert "Press next:" in papilla("identify", "--suggest", 2, "--moduli", "0.1,0.5").out


def test_relaxation_is_fitted_to_the_whole_log(papilla, fitted, tmp_path):
    (tmp_path / "log.csv").chmod(0o644)
    rows = ["t_s,force_N,modulus_MPa,g1,g2", "0,0.1,0.5,1,2", "1,0.4,0.5,2,3", "2,0.4,0.5,3,4"]
    (tmp_path / "log.csv").write_text("\n".join(rows) + "\n")
    answer = papilla("identify", "log.csv", "--out", "f.toml", "--relaxation", 2, "--json")
    assert answer.code == 0, answer.err
    found, log, terms = fitted.touch
    assert found is fitted.found and terms == 2 and log.force_N.tolist() == [0.1, 0.4, 0.4]
    assert json.loads(answer.out)["relaxation"]["by"] == "g1"
    assert fitted.found.kept.relaxation_times_s == (3.0,)


@pytest.mark.parametrize("stated_sd, specimens, refused", [
    (None, ["a"], False), (None, [], False), (None, ["a", "b"], True), ([1.0], ["a"], True),
])  # fmt: skip
def test_relaxation_needs_readings_on_one_specimen(fitted, tmp_path, stated_sd, specimens, refused):
    found = found_of(SimpleNamespace(stated_sd=stated_sd, specimens=specimens))
    if not refused:
        told, kept = identify._relaxation_of(tmp_path / "log.csv", found, "1", None)
        assert (told["relaxation"]["by"], kept) == ("g1", {"relaxation_times_s": (3.0,)})
        return
    with pytest.raises(InputError, match=r"log\.csv: --relaxation needs readings, of presses on one specimen"):
        identify._relaxation_of(tmp_path / "log.csv", found, "1", None)
    assert identify._relaxation_of(tmp_path / "log.csv", found, None, None) == ({}, {})


def test_loops_of_a_log_are_plain_values():
    loop = SimpleNamespace(force_N=0.6, share=0.25)
    assert identify._loops_of(SimpleNamespace(loops=[loop])) == {"loops": [{"force_N": 0.6, "share": 0.25}]}
    assert identify._loops_of(SimpleNamespace(loops=())) == {}
    assert [identify._factor(one) for one in (0.5, 0.999, 1.0)] == ["50 %", "1e+02 %", "more than a factor of two"]


@pytest.mark.parametrize("moduli, places, found", [
    (None, None, ([], [(0.0, 0.0)])), ("0.5,0.1", "1,2 -3,0", ([0.5, 0.1], [(1.0, 2.0), (-3.0, 0.0)])),
])  # fmt: skip
def test_moduli_and_places_of_a_text(moduli, places, found):
    options = SuggestOptions(1, moduli, places, "I")
    assert (options.read_moduli(), options.read_places()) == found


@pytest.mark.parametrize("moduli, places, said", [
    ("0", None, r"--moduli \(MPa\) must be greater than 0"),
    ("a", None, "--moduli must be numbers in MPa with commas, got 'a'"),
    (None, "1,a", "--places must be pairs x,y in mm with spaces between, got 'a'"),
])  # fmt: skip
def test_texts_that_are_no_moduli_and_places(moduli, places, said):
    with pytest.raises(InputError, match=said):
        SuggestOptions(1, moduli, places, "I").check(None)
