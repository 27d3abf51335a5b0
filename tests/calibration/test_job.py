"""From a finger to its calibration, on coarse meshes: what its intervals hold, and what it says about itself."""

import numpy as np
import pytest

from papilla.calibration import SoftnessStatus, calibrate_finger, fit, sweep
from papilla.core.errors import InputError
from papilla.fem import prepare, press
from papilla.model.finger import Finger
from papilla.model.specimen import Block

FORCES, MODULI = np.geomspace(0.1, 1, 9).tolist(), np.geomspace(0.05, 1, 8).tolist()
COARSE = {"size_mm": 2.8, "forces": FORCES, "moduli": MODULI}
FINGER = Finger.default()


@pytest.fixture(scope="module")
def quick():
    """With friction that nobody stated."""
    return calibrate_finger(FINGER, **COARSE, quick=True)


@pytest.fixture(scope="module")
def stuck():
    """The same finger, if presses are known to stick."""
    return calibrate_finger(FINGER, **COARSE, quick=True, friction="stick")


def test_moduli_between_the_points_come_back(quick):
    found = quick.recovery
    assert 0.9 * len(found.error) < found.answered <= len(found.error) == 36
    assert found.force_N.min() >= 0.196 and found.force_N.max() <= 0.981
    assert found.modulus_MPa.min() >= 0.05 and found.modulus_MPa.max() <= 0.72
    assert not {*np.round(found.force_N, 9)} & {*np.round(FORCES, 9)}
    assert found.rms_error <= found.max_error < 0.1, "of presses on a mesh of a few elements"


def test_intervals_hold_the_modulus_of_presses_that_papilla_makes(quick):
    """Of the finger on another coarse mesh than the swept one, stuck and without friction."""
    calibration, other = quick.calibration, prepare(FINGER, size_mm=2.8, variant=1)
    inside = []
    for friction in ("stick", 0.0):
        for force, modulus in ((0.3, 0.08), (0.3, 0.2), (0.6, 0.1), (0.9, 0.3)):
            one = press(other, Block(modulus, 10.0), force=force, friction=friction)
            low, high = calibration.invert(one.sd, force).interval
            inside.append(low <= modulus <= high)
    assert sum(inside) >= 7


def test_friction_that_is_known_widens_no_interval(quick, stuck):
    known, unknown = stuck.calibration, quick.calibration
    assert known.surface.uncertainty.friction is None and known.sigmas["friction"] == 0 < unknown.sigmas["friction"]
    sd = float(known.predict(0.5, 0.2))
    told, doubted = known.invert(sd, 0.5), unknown.invert(sd, 0.5)
    assert told.status is SoftnessStatus.OK and told.modulus_MPa == pytest.approx(doubted.modulus_MPa, rel=1e-9)
    assert doubted.lower_MPa < told.lower_MPa and doubted.sigma_MPa > told.sigma_MPa
    assert any("friction is not known: stick is assumed" in note for note in unknown.notes)
    assert not any("friction is not known" in note for note in known.notes)


def test_the_record_says_what_it_is_of(quick):
    calibration = quick.calibration
    assert calibration.finger["sha256"] == FINGER.sha256 and calibration.ridge_pitch_mm == FINGER.ridge_pitch_mm
    assert calibration.provenance["presses"] == quick.presses.valid.sum() > 60
    assert calibration.provenance["left_out"] == 72 - calibration.provenance["presses"]
    assert calibration.surface.uncertainty.meshes == len(calibration.mesh["scatter_sha256"]) == 1
    assert calibration.domain["force_N"] == pytest.approx((0.1, 1)) and calibration.position is None
    assert any(note.startswith("quick: one other mesh") for note in calibration.notes) and quick.truth is None


def test_large_strain_that_is_not_included_widens_every_interval(stuck):
    """A sweep without it says by how much, relative to S_d."""
    reduced = prepare(FINGER, size_mm=2.8)
    plain = sweep(reduced, MODULI, FORCES, friction="stick", large_strain=False)
    assert plain.strain == pytest.approx(0.018) and 0 < stuck.presses.strain < 0.01
    sure, unsure = (fit(plain, friction_known=True, strain=strain) for strain in (0.001, plain.strain))
    force, modulus = np.array([0.3, 0.6, 0.6]), np.array([0.1, 0.1, 0.3])
    sd = sure.predict(force, modulus)
    (low, high), (lower, higher) = sure.invert(sd, force).interval, unsure.invert(sd, force).interval
    assert (lower < low).all() and (high < higher).all() and unsure.dominant == "large strain"


def test_the_strain_of_a_soft_specimen_widens_intervals_as_far_as_the_skin_hinders_it(stuck):
    """Twice the strain that a skin which sticks hinders, twice the sigma; presses say the same."""
    swept, doubt, skin = stuck.presses, stuck.calibration.surface.uncertainty, FINGER.outer.modulus
    strained = swept.force_N / swept.contact_area_mm2 / swept.modulus_MPa * skin / (skin + swept.modulus_MPa)
    strained = strained[swept.valid]
    points = np.log(np.column_stack([swept.force_N, swept.modulus_MPa])[swept.valid])
    sigmas = np.array([doubt.sigmas(*point)["specimen"] for point in points.tolist()])
    assert strained.max() > 20 * strained.min(), "from soft to hard"
    assert sigmas / strained == pytest.approx(np.full(len(sigmas), np.median(sigmas / strained)), rel=0.5)
    said = np.array(["large strain of the specimen itself" in status for status in swept.status])[swept.valid]
    assert said[np.argmax(strained)] and not said[np.argmin(strained)] and strained[said].min() > strained[~said].max()


def test_two_forces_are_too_few():
    with pytest.raises(InputError, match="three"):
        calibrate_finger(FINGER, **COARSE | {"forces": FORCES[:2]}, quick=True)


@pytest.mark.slow
def test_a_whole_calibration_is_judged_at_finite_strain_on_another_mesh_and_beside_the_apex():
    done = calibrate_finger(FINGER, **COARSE)
    truth, calibration = done.truth, done.calibration
    assert set(truth.frictions) == {"stick", 0.0} and truth.inside.all()
    # Without friction S_d is larger, and a specimen seems harder, or harder than the domain
    stuck, free = (np.nan_to_num(truth.by(friction).error, nan=np.inf).mean() for friction in ("stick", 0.0))
    assert free > stuck and truth.to_json()["inside_interval"] == 1.0
    assert calibration.provenance["laws"] and calibration.surface.uncertainty.meshes == 3
    # A touch beside the apex is what the same touch mirrored is, with the gauges in the other order
    right, left = (calibration.predict_readings(0.5, 0.3, x) for x in (3.0, -3.0))
    assert right == pytest.approx(left[::-1], rel=0.03, abs=0.01 * np.abs(left).max())
