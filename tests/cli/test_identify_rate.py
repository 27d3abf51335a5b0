"""`papilla identify` on a log over time: loading alone, loops, relaxation."""

import json

import numpy as np
import pytest

from papilla.fem.pressing.response import response
from papilla.fem.reduction.family import family
from papilla.identification import posing
from papilla.model.finger import Finger
from papilla.model.specimen import Block
from papilla.references import Prony

SIZE_MM = 2.8
SILICONE = Prony((0.25,), (3.0,))


@pytest.fixture
def over_time(tmp_path, monkeypatch):
    """Writes a log of two touches, ramp, hold and return, of a finger that relaxes."""
    monkeypatch.setattr(posing, "SIZE_MM", SIZE_MM)
    felt = response(family(Finger.default(), size_mm=SIZE_MM), Block(1.0, 10.0)).felt

    def write(*columns, hold=20.0):
        time = np.concatenate(
            [np.linspace(0.1, 2, 12), np.linspace(2.5, 2 + hold, 30), 2 + hold + np.linspace(0.2, 2, 10)]
        )
        shape = np.concatenate([np.linspace(0.1, 1, 12), np.ones(30), np.linspace(0.9, 0.1, 10)])
        rows = []
        for number, (modulus, most) in enumerate(((0.72, 0.6), (0.51, 0.8))):
            force = most * shape
            told = felt(SILICONE.strained(time, force), np.full(len(time), modulus), 0.15, 0.03)
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
    out = tmp_path / "finger.toml"
    answer = papilla("identify", log, "--out", out, "--relaxation", 1, "--json")
    assert answer.code == 0, answer.err
    assert "80 of 104 rows hold or unload the finger (t_s): the fit is of loading alone" in answer.err
    found = json.loads(answer.out)
    assert found["presses"] == 24
    told = found["relaxation"]
    assert told["by"] == by
    assert told["terms"][0]["share"] == pytest.approx(0.25, abs=0.08)
    assert told["terms"][0]["time_s"] == pytest.approx(3.0, rel=0.4)
    identified = Finger.load(out).identified
    assert identified.relaxation_times_s == (told["terms"][0]["time_s"],)
    assert identified.crept == tuple(told["crept"])
    assert identified.crept == pytest.approx((1.0, 1.08), abs=0.03), "a ramp of 2 s, a time of 3 s"
    if deep:
        assert len(found["loops"]) == 2 and all(0 < one["share"] < 1 for one in found["loops"])
        assert "a loop to 0.6 N on 0.72 MPa lost" in answer.err


def test_relaxation_needs_times(refused, over_time):
    log = over_time("force_N", "modulus_MPa", *GAUGES)
    assert "--relaxation needs a log of presses" in refused(
        "identify", "--relaxation", 1, "--suggest", 1, "--moduli", "0.1"
    )
    answer = refused("identify", log, "--relaxation", 1, "--suggest", 1)
    assert "--relaxation needs a column t_s" in answer


def test_times_that_fall_are_refused(refused, tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("t_s,force_N,modulus_MPa,g1\n0,0.1,0.5,10\n2,0.2,0.5,20\n1,0.3,0.5,30\n")
    assert "column t_s: must rise, got 1 after 2" in refused("identify", log, "--out", "f.toml")
