"""The main job on the made-up finger: which meshes, tables and checks go into a calibration."""

from types import SimpleNamespace

import numpy as np
import pytest

from papilla.calibrate import DEFAULT_FORCES, DEFAULT_MODULI, job
from papilla.finger import Finger


@pytest.fixture
def made(monkeypatch, tmp_path, truth):
    """The job with presses from closed forms: the mesh of variant v reads v / 1000 more. Notes what it is asked."""
    asked = {"prepared": [], "swept": [], "positions": []}

    def prepare(finger, *, variant=0, progress):
        asked["prepared"].append((finger, variant))
        return SimpleNamespace(variant=variant, to_arrays=lambda: {"variant": np.array(variant)})

    def sweep(reduced, moduli, forces, progress, friction):
        asked["swept"].append((reduced.variant, len(moduli), len(forces)))
        name = f"mesh {reduced.variant}"
        return truth.sweep(moduli, forces, change=lambda *_: 1 + reduced.variant / 1000, mesh_sha256=name)

    def press(reduced, specimen, *, force, fidelity, friction):
        assert (reduced.variant, specimen.thickness, fidelity) == (0, 10.0, "contact")
        return SimpleNamespace(sd=float(truth.sd(force, specimen.modulus)))

    def with_positions(calibration, finger, reduced):
        asked["positions"].append((finger, reduced.variant))
        return calibration

    sweep.__module__ = "papilla.calibrate.press_table"
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path))
    monkeypatch.setattr(job.fem, "prepare", prepare)
    monkeypatch.setattr(job.fem, "press", press)
    monkeypatch.setattr(job, "sweep", sweep)
    monkeypatch.setattr(job, "with_positions", with_positions)
    monkeypatch.setattr(job, "build", lambda finger: None)
    monkeypatch.setattr(job, "ensure_large_strain", lambda *_: "large strain is not included: it is not asked for")
    monkeypatch.setattr(job, "corrected", lambda reduced, found, friction: found)
    monkeypatch.setattr(job, "tables_of", lambda reduced, friction: ())
    return asked


def test_a_finger_is_calibrated_on_one_mesh_and_judged_by_four(made):
    finger, lines = Finger.default(), []
    done = job.calibrate_finger(finger, progress=lines.append)
    assert made["prepared"] == [(finger, variant) for variant in range(5)]
    assert made["swept"] == [(0, 43, 60), *((variant, 8, 10) for variant in (1, 2, 3, 4))]
    assert made["positions"] == [(finger, 0)]
    calibration = done.calibration
    assert "large strain is not included: it is not asked for" in calibration.notes
    assert calibration.mesh["scatter_sha256"] == ["mesh 1", "mesh 2", "mesh 3", "mesh 4"]
    assert len(done.presses) == len(DEFAULT_MODULI) * len(DEFAULT_FORCES) == calibration.provenance["presses"]
    # ln(1 + v / 1000) for v = 1 to 4: rms 0.0027.
    assert calibration.surface.uncertainty.scatter == pytest.approx(np.sqrt(7.5) * 1e-3, rel=0.01)
    assert "mesh scatter, mesh 4 of 4" in lines and lines[-1] == "contacts beside the apex"
    job.calibrate_finger(finger)
    assert len(made["swept"]) == 5, "the second time the tables come from the cache"


def test_the_check_is_between_the_points_within_its_limits(made):
    recovery = job.calibrate_finger(Finger.default()).recovery
    assert len(recovery.error) == recovery.answered == 100
    assert recovery.force_N.min() >= 0.1961 and recovery.force_N.max() <= 0.9807
    assert recovery.modulus_MPa.min() >= 0.05 and recovery.modulus_MPa.max() <= 0.72
    assert not set(recovery.force_N) & set(DEFAULT_FORCES)
    assert recovery.force_N.max() > 0.9 and recovery.modulus_MPa.max() > 0.6
    assert recovery.rms_error <= recovery.max_error < 0.001
