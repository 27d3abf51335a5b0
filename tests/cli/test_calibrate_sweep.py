"""Sweep options of `papilla calibrate`: they reach the sweep, and what does not go together is refused."""

import json
import math

import numpy as np
import pytest

from papilla import Calibration, Finger
from papilla.calibration import DEFAULT_FORCES, DEFAULT_MODULI
from papilla.calibration.fitting import job
from papilla.core.errors import PapillaError
from papilla.model.specimen import HalfSpace


@pytest.fixture
def asked(papilla, monkeypatch):
    """What `calibrate_finger` is asked for by some options."""

    def call(*arguments) -> dict:
        seen = {}

        def stop(finger, **how):
            seen.update(how, finger=finger)
            raise PapillaError("enough")

        with monkeypatch.context() as patch:
            patch.setattr("papilla.identification.bench.calibrate", stop)
            assert papilla("calibrate", *arguments).err.endswith("enough\n")
        return seen

    return call


def test_without_options_the_sweep_is_the_default_one(asked):
    seen = asked()
    assert seen["quick"] is False and not {"forces", "moduli"} & {*seen}
    assert seen["finger"] == Finger.default()


def test_ranges_lists_and_specimens_reach_the_sweep(asked):
    seen = asked("--force-range", 0.1, 0.5, "--moduli", "0.5,0.1", "--thickness", 5)
    assert len(seen["forces"]) == len(DEFAULT_FORCES) and (seen["forces"][0], seen["forces"][-1]) == (
        0.1,
        pytest.approx(0.5),
    )
    assert len(seen["moduli"]) == len(DEFAULT_MODULI) and seen["moduli"][0] == pytest.approx(0.1)
    assert seen["finger"].bench.thickness == 5
    assert asked("--moduli", "0.51,0.089,0.72")["moduli"] == (0.089, 0.51, 0.72)
    assert isinstance(asked("--specimen", "half-space")["finger"].bench.specimen(0.5), HalfSpace)
    quick = asked("--quick")
    assert quick["quick"] and len(quick["forces"]) < 20 and quick["forces"][-1] == pytest.approx(DEFAULT_FORCES[-1])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--moduli", "0.1"), "--moduli needs the two ends of a range, or three or more moduli"),
        (("--moduli", "a,b"), "--moduli must be numbers in MPa with commas, got 'a'"),
        (("--force-range", 1, 0.5), "--force-range (N) must rise, got 1 and 0.5"),
        (("--specimen", "half-space", "--thickness", 5), "--thickness is for a block, not for a half-space"),
        (("--specimen", "sphere"), "'sphere' is not one of"),
        (("--thickness", 0), "--thickness (mm) must be greater than 0, got 0"),
        (("--bench", "p.csv", "--specimen", "half-space"), "leave out --specimen half-space"),
    ],
)
def test_what_does_not_go_together_is_refused(refused, arguments, message):
    assert message in refused("calibrate", *arguments)


def test_a_bench_of_half_spaces_is_written_and_read(tmp_path):
    from dataclasses import replace

    finger = Finger.default()
    flat = replace(finger, bench=replace(finger.bench, thickness=math.inf))
    flat.save(tmp_path / "f.toml")
    assert "thickness_mm = inf" in (tmp_path / "f.toml").read_text(encoding="utf-8")
    assert Finger.load(tmp_path / "f.toml") == flat


@pytest.mark.slow
def test_a_quick_calibration_is_near_the_whole_one_and_says_what_it_lacks(papilla):
    from papilla import Block, fem

    answer = papilla("calibrate", "--quick", "--moduli", "0.05,1", "--out", "q", "--json")
    assert answer.code == 0, answer.err
    facts = json.loads(answer.out)
    assert job.QUICK in facts["notes"] and facts["truth"] is None
    made = Calibration.load(facts["calibration"])
    assert made.domain["modulus_MPa"] == pytest.approx((0.05, 1.0)) and made.position is None
    reduced = fem.prepare(Finger.default())
    for force, modulus in ((0.2, 0.1), (0.6, 0.3)):
        found = fem.press(reduced, Block(modulus, 10), force=force)
        assert made.predict(force, modulus) == pytest.approx(found.sd, rel=0.01)
    assert np.isfinite(made.invert(found.sd, 0.6).modulus_MPa)
