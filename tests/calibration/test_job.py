"""The main job on the made-up finger: which meshes, tables and checks go into a calibration."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.calibration import DEFAULT_FORCES, DEFAULT_MODULI
from papilla.calibration.fitting import job
from papilla.model.finger import Bench, Finger
from papilla.model.specimen import STICK

FREE = 0.03
"""What S_d of the made-up finger is larger by without friction."""


@pytest.fixture
def made(monkeypatch, tmp_path, truth):
    """The job with presses from closed forms: the mesh of variant v reads v / 1000 more. Notes what it is asked."""
    asked = {
        "prepared": [],
        "swept": [],
        "checked": [],
        "positions": [],
        "truth": [],
        "laws": "laws stable over the strains reached",
    }

    def prepare(finger, *, size_mm, variant=0, progress):
        progress("meshing, 3 s")
        asked["prepared"].append((finger, variant, size_mm))
        return SimpleNamespace(variant=variant, bench=finger.bench, to_arrays=lambda: {"variant": np.array(variant)})

    def sweep(reduced, moduli, forces, specimen, progress=None, friction=None):
        asked["thickness"] = specimen(0.1).thickness
        swept = (reduced.variant, len(moduli), len(forces), friction)
        asked["checked" if swept[:3] == (0, 10, 10) else "swept"].append(swept)
        size = (1 + reduced.variant / 1000) * (1 if friction else 1 + FREE)
        name = f"mesh {reduced.variant}"
        return truth.sweep(moduli, forces, change=lambda *_: size, mesh_sha256=name, friction=friction)

    def press_truth(finger, size_mm, friction, say):
        asked["truth"].append((size_mm, friction))
        rows = [(math.inf, 0.3, 0.1, 1.0), (math.inf, 0.9, 0.4, 1.0), (0.0, 0.3, 0.1, 1 + FREE), (0.0, 9.0, 0.1, 1.0)]
        rows = [(mu, f, E, size * float(truth.sd(f, E))) for mu, f, E, size in rows if bool(mu) == (friction == STICK)]
        return np.array(rows), asked["laws"]

    def with_positions(calibration, finger, reduced, friction):
        asked["positions"].append((finger, reduced.variant, friction))
        return calibration

    sweep.__module__ = "papilla.calibration.fitting.sweep"
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path))
    monkeypatch.setattr(job.fem, "prepare", prepare)
    monkeypatch.setattr(job, "sweep", sweep)
    monkeypatch.setattr(job, "with_positions", with_positions)
    monkeypatch.setattr(job, "press_truth", press_truth)
    monkeypatch.setattr(job, "begin_large_strain", lambda *_, **__: lambda: "")
    monkeypatch.setattr(job, "large_strain_error", lambda reduced, friction: 0.001)
    monkeypatch.setattr(job, "tables_of", lambda reduced, stuck: ())
    monkeypatch.setattr(job, "published_depths", lambda finger, reduced: [])
    return asked


def test_a_bench_says_block_and_friction_unless_another_is_asked_for(made):
    finger = replace(Finger.default(), bench=Bench(12.0, 0.0))
    calibration = job.calibrate_finger(finger).calibration
    assert made["thickness"] == 12.0 and made["swept"][0] == (0, 43, 60, 0.0) and made["truth"] == [(0.7, 0.0)]
    assert not any("friction is not known" in note for note in calibration.notes)
    made["swept"].clear()
    job.calibrate_finger(finger, friction="stick")
    assert made["swept"][0] == (0, 43, 60, "stick")


def test_a_finger_is_calibrated_on_one_mesh_and_judged_by_three(made, truth):
    finger, lines = Finger.default(), []
    done = job.calibrate_finger(finger, progress=lines.append)
    assert made["prepared"] == [(finger, variant, 0.7) for variant in range(4)]
    assert [f"mesh {number} of 5: meshing, 3 s" for number in range(1, 5)] == [line for line in lines if "3 s" in line]
    assert made["swept"] == [(0, 43, 60, "stick"), (0, 43, 60, 0.0), *((k, 8, 10, 0.0) for k in (1, 2, 3))]
    assert made["positions"] == [(finger, 0, "stick")]
    calibration = done.calibration
    assert calibration.ridge_pitch_mm == 1.2
    assert any(note.startswith("friction is not known: stick is assumed") for note in calibration.notes)
    assert calibration.mesh["scatter_sha256"] == ["mesh 1", "mesh 2", "mesh 3"]
    assert len(done.presses) == len(DEFAULT_MODULI) * len(DEFAULT_FORCES) == calibration.provenance["presses"]
    # ln(1 + v / 1000) for v = 1 to 3: rms 0.0022. Friction, which shifts all of a mesh's presses alike, is no scatter.
    known = calibration.surface.uncertainty
    assert known.scatter == pytest.approx(np.sqrt(14 / 3) * 1e-3, rel=0.01)
    assert known.strain == 0.001 and known.friction(0.3, 0.3) == pytest.approx(np.log1p(FREE), rel=1e-6)
    reading = truth.readings(0.3, 0.3)[2] / 0.3
    assert calibration.gauges[2].uncertainty.friction(0.3, 0.3) == pytest.approx(FREE * reading, rel=1e-3)
    assert calibration.dominant == "friction"
    assert "mesh scatter: 3 of 3 meshes" in lines and "contacts beside the apex" in lines
    job.calibrate_finger(finger)
    assert len(made["swept"]) == 5, "the second time the tables come from the cache"


def test_friction_that_is_known_widens_no_interval(made):
    finger = Finger.default()
    known, unknown = (job.calibrate_finger(finger, friction=friction).calibration for friction in ("stick", None))
    assert known.surface.uncertainty.friction is None and known.dominant == "mesh"
    sd = float(known.predict(0.3, 0.2))
    told, open_to = known.invert(sd, 0.3), unknown.invert(sd, 0.3)
    assert told.modulus_MPa == pytest.approx(open_to.modulus_MPa, rel=1e-9)
    assert (told.dominant, open_to.dominant) == ("mesh", "friction")
    # A press without friction is the same finger's on a softer specimen, and the other end hardly moves.
    assert unknown.invert(sd * (1 + FREE), 0.3).lower_MPa < 0.2 < known.invert(sd * (1 + FREE), 0.3).lower_MPa
    assert open_to.upper_MPa <= told.upper_MPa


def test_large_strain_that_is_not_included_widens_every_interval(made, monkeypatch):
    said = "large strain is not included: the finger is one layer"
    monkeypatch.setattr(job, "begin_large_strain", lambda *_, **__: lambda: said)
    calibration = job.calibrate_finger(Finger.default()).calibration
    assert {friction for *_, friction in made["swept"]} == {0.0}
    assert calibration.surface.uncertainty.strain == 0.018 and calibration.dominant == "large strain"
    assert any(note.startswith("large strain is not included: the finger is one layer") for note in calibration.notes)


def test_the_check_is_between_the_points_within_its_limits(made):
    recovery = job.calibrate_finger(Finger.default()).recovery
    assert len(recovery.error) == recovery.answered == 100
    assert recovery.force_N.min() >= 0.1961 and recovery.force_N.max() <= 0.9807
    assert recovery.modulus_MPa.min() >= 0.05 and recovery.modulus_MPa.max() <= 0.72
    assert not set(recovery.force_N) & set(DEFAULT_FORCES)
    assert recovery.force_N.max() > 0.9 and recovery.modulus_MPa.max() > 0.6
    assert recovery.rms_error <= recovery.max_error < 0.001


def test_a_calibration_is_judged_by_presses_at_finite_strain_on_another_mesh(made):
    truth = job.calibrate_finger(Finger.default()).truth
    assert made["truth"] == [(0.7, STICK), (0.7, 0.0)]
    assert len(truth.force_N) == 3, "the press outside of the domain is left out"
    assert truth.frictions == ["stick", 0.0] and truth.inside.all()
    assert np.abs(truth.by("stick").error).max() < 0.01 < 0.05 < truth.by(0.0).error.max()
    found = truth.to_json()
    assert found["sd_max_error"]["0"] == pytest.approx(FREE / (1 + FREE), rel=0.01)
    assert (found["presses"], found["inside_interval"]) == (3, 1.0)


def test_a_law_that_is_unstable_over_the_strains_reached_is_a_doubt(made):
    stable = job.calibrate_finger(Finger.default(), friction="stick").calibration
    assert made["truth"] == [(0.7, STICK)]
    assert stable.provenance["laws"] == made["laws"] and not any("law" in note for note in stable.notes)
    made["laws"] = "not to be trusted: a material's law is unstable within the stretches reached"
    assert made["laws"] in job.calibrate_finger(Finger.default(), friction="stick").calibration.notes
