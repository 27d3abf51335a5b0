"""The calibration of an identified finger: its covariance in every interval, the bench's zeros, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from spring_calibration import calibration

from papilla.calibration import Calibration
from papilla.cli.estimate import _zeros
from papilla.core.errors import InputError
from papilla.identification import posing
from papilla.identification.identified_finger import with_identification
from papilla.model.finger import Finger
from papilla.model.parts import Identified

SIGMA = 0.1


@pytest.fixture
def finger(monkeypatch):
    """A finger all of whose gains are known to 10 % together, so that S_d is."""
    monkeypatch.setattr(posing, "SIZE_MM", 2.8)
    names = tuple(f"gain.g{k}" for k in range(1, 6))
    told = Identified(
        status="ok: told",
        presses=5,
        specimen="block",
        friction="stick",
        zeros_microstrain=(5.0, -4.0, 3.0, -2.0, 1.0),
        touch_down_mm=0.1,
        parameters=names,
        logarithmic=(False,) * 5,
        values=(1.0,) * 5,
        lower=(0.8,) * 5,
        upper=(1.2,) * 5,
        covariance=((SIGMA**2,) * 5,) * 5,
        chi_square=1.0,
        freedom=1.0,
        force_error=0.01,
        noise_microstrain=5.0,
        notes=("g1 is told by few presses",),
    )
    return replace(Finger.default(), identified=told)


def test_what_gains_leave_open_is_in_the_interval_and_zeros_are_kept(finger, tmp_path):
    before = calibration()
    after = with_identification(before, finger)
    for force, modulus in ((0.1, 0.1), (0.6, 0.5)):
        sigmas = after.surface.uncertainty.sigmas(np.log(force), np.log(modulus))
        assert sigmas["identification"] == pytest.approx(SIGMA, rel=0.02)
    sd = float(before.predict(0.5, 0.3))
    one, other = (each.invert(sd, 0.5) for each in (before, after))
    assert other.modulus_MPa == one.modulus_MPa and other.sigma_MPa > 2 * one.sigma_MPa
    assert other.lower_MPa < one.lower_MPa and other.upper_MPa > one.upper_MPa
    assert after.dominant == "identification" and any("told by few presses" in note for note in after.notes)
    assert "relaxation" not in after.finger
    told = replace(finger.identified, relaxation_shares=(0.2,), relaxation_times_s=(3.0,), crept=(1.0, 1.1))
    crept = with_identification(before, replace(finger, identified=told))
    assert crept.finger["relaxation"] == {"shares": [0.2], "times_s": [3.0], "crept": [1.0, 1.1]}
    assert list(_zeros(after)) == list(finger.identified.zeros_microstrain)
    after.save(tmp_path / "c.json")
    again = Calibration.load(tmp_path / "c.json")
    assert again.invert(sd, 0.5).sigma_MPa == other.sigma_MPa and list(_zeros(again)) == list(_zeros(after))
    assert with_identification(before, Finger.default()) is before


def test_a_design_that_was_changed_since_is_refused(finger):
    gauges = (replace(finger.gauges[0], membrane_gain=2.0), *finger.gauges[1:])
    with pytest.raises(InputError, match="gain.g1 is 2 in the design and 1 in its .identified."):
        with_identification(calibration(), replace(finger, gauges=gauges))


def test_parameters_of_other_gauges_are_refused(finger):
    told = replace(finger.identified, parameters=(*(f"gain.g{k}" for k in range(1, 5)), "gain.g9"))
    with pytest.raises(InputError, match="has gain.g9, which is no parameter"):
        with_identification(calibration(), replace(finger, identified=told))


def test_zeros_of_another_number_of_gauges_are_refused():
    spoilt = replace(calibration(), finger={"name": "", "sha256": "", "zeros_microstrain": [1.0]})
    with pytest.raises(InputError, match="zeros_microstrain must hold 5 numbers"):
        _zeros(spoilt)
    assert _zeros(None).size == 0 and _zeros(calibration()).size == 0


def test_a_bench_is_identified_calibrated_and_recovered(monkeypatch):
    from papilla.calibration.fitting import job
    from papilla.fem.pressing.response import response
    from papilla.identification import bench
    from papilla.identification.posing import family_of
    from papilla.logs import PressLog
    from papilla.model.specimen import Block

    monkeypatch.setattr(posing, "SIZE_MM", 2.8)
    smooth = response(family_of(Finger.default()), Block(1.0, 10.0))
    force, modulus = (one.ravel() for one in np.meshgrid((0.1, 0.2, 0.4, 0.7, 0.98), (0.089, 0.51)))
    felt = smooth.felt(force, modulus, 0.2, 0.04)
    rng = np.random.default_rng(5)
    zeros = np.array([5.0, -10.0, 15.0, 0.0, -20.0])
    readings = 1e5 * felt.values[:, 0] + zeros + 5 * rng.normal(size=(10, 5))
    log = PressLog(force, modulus, readings, tuple(f"g{k}" for k in range(1, 6)), felt.indentation + 0.1)

    def swept(finger, **_):
        return job.Calibrated(with_identification(calibration(), finger), log, job.Recovery(force, modulus, modulus))

    monkeypatch.setattr(bench, "calibrate", swept)
    with pytest.raises(InputError, match="press 10 is beside the apex, where S_d differs: papilla identify takes it"):
        bench.calibrate_bench(replace(log, x_mm=np.arange(10) == 9), Finger.default())
    done = bench.calibrate_bench(log, Finger.default())
    assert done.bench.finger.identified.presses == 10 and done.bench.finger.outer.modulus > 0.1
    told = np.array(done.bench.finger.identified.zeros_microstrain)
    # Moduli follow from S_d without the zeros, and intervals from the noise of five gauges and of the force
    noise = {"sd_sigma": 5 / np.sqrt(5), "force_sigma": 0.01 * force}
    answer = done.calibration.invert((readings - told).std(axis=1), force, **noise)
    assert done.bench.recovery.recovered_MPa == pytest.approx(answer.modulus_MPa, nan_ok=True)
    assert (done.bench.inside == ((answer.lower_MPa <= modulus) & (modulus <= answer.upper_MPa))).all()
    assert list(done.calibration.finger["zeros_microstrain"]) == told.tolist()
    # The same log with S_d alone has no zeros
    sd = (readings - zeros).std(axis=1)
    alone = replace(log, readings=np.zeros((10, 0)), gauge_names=(), stated_sd=sd)
    done = bench.calibrate_bench(alone, Finger.default())
    answer = done.calibration.invert(sd, force, **noise)
    assert done.bench.recovery.recovered_MPa == pytest.approx(answer.modulus_MPa, nan_ok=True)
