"""`papilla identify`: a finger that every command takes, what it says of it, and what it refuses."""

import json
import tomllib

import numpy as np
import pytest

from papilla.fem.pressing.response import response
from papilla.identification.posing import family_of
from papilla.identification.suggest import SUGGESTED_FORCES_N
from papilla.model.finger import Finger
from papilla.model.specimen import Block
from papilla.references import Prony


@pytest.fixture(scope="module")
def smooth():
    return response(family_of(Finger.default()), Block(1.0, 10.0))


class Law:
    """Strains by powers of the force, for logs that are refused before they are compared with a finger."""

    def felt(self, force, modulus, outer, inner):
        strain = 0.01 * force**0.7 * modulus**0.2
        pattern = np.array([[-1.0, 2.0, 4.0, 2.0, -1.0], [1.0, 1.0, -2.0, 1.0, 1.0]])
        self.values, self.indentation = strain[:, None, None] * pattern, 2 * force**0.6
        return self


@pytest.fixture
def bench(request, tmp_path):
    """Writes a log of presses; changes: columns by name, or a factor of one."""

    def write(name="log.csv", real=True, **changes):
        rng = np.random.default_rng(2)
        force, modulus = (one.ravel() for one in np.meshgrid((0.1, 0.2, 0.4, 0.7, 0.98), (0.089, 0.51)))
        smooth = request.getfixturevalue("smooth") if real else Law()
        felt = smooth.felt(force * (1 + 0.01 * rng.normal(size=10)), modulus, 0.2, 0.04)
        gain, lever = np.array([0.1, -0.3, 0.2, 0.15, 0.1]), np.array([0.05, 0.1, -0.2, -0.1, 0.0])
        readings = 1e6 * (gain * felt.values[:, 0] + lever * felt.values[:, 1]) + [5, -10, 15, 0, -20]
        columns = {"force_N": force, "modulus_MPa": modulus}
        columns |= {f"g{k + 1}": readings[:, k] + 5 * rng.normal(size=10) for k in range(5)}
        columns["indentation_mm"] = felt.indentation + 0.15
        for key, change in changes.items():
            columns[key] = change(columns[key]) if callable(change) else change
        columns = {key: values for key, values in columns.items() if values is not None}
        path = tmp_path / name
        np.savetxt(path, np.column_stack([*columns.values()]), delimiter=",", header=",".join(columns), comments="")
        return path

    return write


@pytest.mark.slow
def test_a_log_becomes_a_finger_that_other_commands_take(papilla, bench, tmp_path):
    out, report = tmp_path / "f.toml", tmp_path / "r.html"
    answer = papilla("identify", bench(), "--out", out, "--report", report, "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    outer = found["parameters"]["outer_modulus_MPa"]
    assert outer["lower"] < 0.2 < outer["upper"] and outer["lower"] < outer["value"] < outer["upper"]
    assert found["presses"] == 10 and found["friction"] == "not told" and found["finger"] == str(out)
    assert found["physics"] == "block 10 mm thick, friction not stated, large strain included"
    assert any("g2 reads backwards" in doubt for doubt in found["doubts"])
    assert "but 1 of 5 gauges read backwards: identified from 10 presses" in found["status"]
    finger = Finger.load(out)
    assert finger.outer.modulus == outer["value"] and finger.gauges[1].membrane_gain < 0
    assert finger.identified.zeros_microstrain[2] == found["parameters"]["zero_microstrain.g3"]["value"]
    assert finger.bench.touch_down == pytest.approx(0.15, abs=0.03)
    assert finger.sha256 == Finger.load(out).sha256
    page = report.read_text()
    assert "inner_modulus_MPa" in page and page.count("<img") == 2 and "http" not in page.split("<img")[0]
    again = tmp_path / "again.toml"
    finger.save(again)
    assert tomllib.loads(again.read_text()) == tomllib.loads(out.read_text())


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes, options, message",
    [
        ({"force_N": lambda force: 102 * force}, [], "is force_N in N (1 gf is 0.0098 N)"),
        ({"modulus_MPa": lambda modulus: 1000 * modulus}, [], "is it in kPa?"),
        ({f"g{k}": lambda reading: 1e-6 * reading for k in range(1, 6)}, [], "are these strains?"),
        ({"g5": None}, [], "the log has 4 gauges (g1, g2, g3, g4), the finger"),
        ({"g6": np.ones(10)}, [], "the log has 6 gauges"),
        (
            {f"g{k}": None for k in range(1, 6)} | {"sd_microstrain": np.full(10, 500.0)},
            ["--free", "gain"],
            "gain.g1 needs readings, and the log has S_d alone, which determines common_gain",
        ),
        ({"x_mm": 9 * np.ones(10)}, [], "x_mm is 9 in press 1: contacts are known within 5 mm of the apex"),
        ({"g2": np.full(10, np.nan)}, [], "expected a finite number, got nan"),
        ({}, ["--fix", "gain"], "--fix takes NAME=VALUE, got 'gain'"),
        ({}, ["--fix", "gain=many"], "--fix gain must be a number, got 'many'"),
        ({}, ["--free", "thicknes_mm"], "did you mean thickness_mm?"),
        ({}, ["--out", "log.csv"], "would overwrite the input"),
        ({}, ["--specimen", "sphere"], "a sphere needs --radius"),
    ],
)
def test_what_cannot_be_identified_is_one_line(papilla, refused, bench, changes, options, message):
    path = bench(real=False, **changes)
    out = [] if "--out" in options else ["--out", "f.toml"]
    papilla("identify", path, *out, *options)  # A cold cache counts its presses before the refusal
    assert message in refused("identify", path, *out, *options)


@pytest.mark.slow
def test_compare_says_fine_or_recalibrate_by_its_exit_code(papilla, bench):
    assert papilla("identify", bench(), "--out", "f.toml").code == 0
    same = papilla("identify", "log.csv", "--compare", "f.toml", "--json")
    assert same.code == 0 and json.loads(same.out)["verdict"].startswith("fine")
    moved = bench("later.csv", g1=lambda reading: reading + 500)
    other = papilla("identify", moved, "--compare", "f.toml")
    assert other.code == 1 and "recalibrate" in other.out and "zero_microstrain.g1" in other.out


@pytest.mark.slow
def test_s_d_alone_and_a_specimen_in_each_row(papilla, bench, tmp_path):
    """The page and the finger of a log whose gauges were not kept, as of one on a bench that is not the design's."""
    log = bench()
    table = np.loadtxt(log, delimiter=",", skiprows=1)
    sd = (table[:, 2:7] - [5, -10, 15, 0, -20]).std(axis=1)
    lines = ["force_N,modulus_MPa,sd_microstrain,indentation_mm,specimen,thickness_mm,modulus_sigma_MPa"]
    lines += [f"{row[0]},{row[1]},{one},{row[7]},block,10,0.002" for row, one in zip(table, sd, strict=True)]
    log.write_text("\n".join(lines) + "\n")
    out, report = tmp_path / "f.toml", tmp_path / "r.html"
    answer = papilla("identify", log, "--out", out, "--report", report)
    assert answer.code == 0, answer.err
    assert "common_gain" in answer.out and "specimen_modulus.0.089" in answer.out and "Held where they" in answer.out
    finger = Finger.load(out)
    assert finger.gauges[0].membrane_gain == finger.identified.values[finger.identified.parameters.index("gain.g1")]
    assert "S_d" in report.read_text()


# ---- Protocols from nothing and after a log


@pytest.mark.slow
@pytest.mark.parametrize("criterion", ["I", "D"])
def test_a_protocol_from_nothing_and_after_a_log(papilla, bench, tmp_path, criterion):
    options = ("--suggest", 3, "--moduli", "0.089,0.72", "--criterion", criterion)
    found = json.loads(papilla("identify", *options, "--json").out)
    assert len(found["suggested"]) == 3 and found["criterion"] == criterion
    assert {one["modulus_MPa"] for one in found["suggested"]} <= {0.089, 0.72}
    assert {one["force_N"] for one in found["suggested"]} <= set(SUGGESTED_FORCES_N)
    assert found["expected_sigma_ln_E"]["after"] < found["expected_sigma_ln_E"]["before"]
    told = papilla("identify", *options).out
    assert "Press next, at the apex:" in told and "20-100 gf" in told
    after = papilla("identify", bench(), "--suggest", 2, "--criterion", criterion, "--json")
    assert after.code == 0, after.err
    assert {one["modulus_MPa"] for one in json.loads(after.out)["suggested"]} <= {0.089, 0.51}
    assert [path.name for path in tmp_path.iterdir()] == ["log.csv"]


# ---- A log over time: loading alone, loops, relaxation

SILICONE = Prony((0.25,), (3.0,))


@pytest.fixture
def over_time(smooth, tmp_path):
    """Writes a log of two touches, ramp, hold and return, of a finger that relaxes."""

    def write(*columns, hold=20.0):
        parts = np.linspace(0.1, 2, 12), np.linspace(2.5, 2 + hold, 30), 2 + hold + np.linspace(0.2, 2, 10)
        time = np.concatenate(parts)
        shape = np.concatenate([np.linspace(0.1, 1, 12), np.ones(30), np.linspace(0.9, 0.1, 10)])
        rows = []
        for number, (modulus, most) in enumerate(((0.72, 0.6), (0.51, 0.8))):
            force = most * shape
            told = smooth.felt(SILICONE.strained(time, force), np.full(len(time), modulus), 0.15, 0.03)
            readings = 1e6 * (0.3 * told.values[:, 0] - 0.2 * told.values[:, 1])
            one = {"force_N": force, "modulus_MPa": np.full(len(time), modulus), "t_s": time + 100 * number}
            one["indentation_mm"] = told.indentation + 0.15
            one |= {f"g{k + 1}": readings[:, k] for k in range(5)}
            rows.append(np.column_stack([one[name] for name in columns]))
        path = tmp_path / "log.csv"
        np.savetxt(path, np.vstack(rows), delimiter=",", header=",".join(columns), comments="")
        return path

    return write


GAUGES = ("g1", "g2", "g3", "g4", "g5")


@pytest.mark.slow
@pytest.mark.parametrize("by", ["indentation", "S_d"])
def test_loading_alone_is_fitted_and_the_hold_tells_the_silicone(papilla, over_time, tmp_path, by):
    deep = ("indentation_mm",) if by == "indentation" else ()
    log = over_time("t_s", "force_N", "modulus_MPa", *GAUGES, *deep)
    answer = papilla("identify", log, "--out", "finger.toml", "--relaxation", 1, "--json")
    assert answer.code == 0, answer.err
    assert "80 of 104 rows hold or unload the finger (t_s): the fit is of loading alone" in answer.err
    found = json.loads(answer.out)
    told = found["relaxation"]
    assert found["presses"] == 24 and told["by"] == by
    assert told["terms"][0]["share"] == pytest.approx(0.25, abs=0.08)
    assert told["terms"][0]["time_s"] == pytest.approx(3.0, rel=0.4)
    identified = Finger.load(tmp_path / "finger.toml").identified
    assert identified.relaxation_times_s == (told["terms"][0]["time_s"],)
    assert identified.crept == tuple(told["crept"]) == pytest.approx((1.0, 1.08), abs=0.03), (
        "a ramp of 2 s, a time of 3 s"
    )
    if deep:
        assert len(found["loops"]) == 2 and all(0 < one["share"] < 1 for one in found["loops"])
        assert "a loop to 0.6 N on 0.72 MPa lost" in answer.err
