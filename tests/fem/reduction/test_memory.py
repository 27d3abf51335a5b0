"""Memory of a model: the law against what a process really takes, and refusals before anything is factorised."""

import json
import os
import subprocess
import sys

import pytest

from papilla.core.errors import MemoryEstimateError
from papilla.core.memory import MEASURED_MEMORY_RATIO, finite_bytes, reduction_bytes
from papilla.fem import FingerModel, press_finite
from papilla.mesh import build
from papilla.model.finger import Finger
from papilla.model.specimen import Block

MEASURE = """
import json, sys
import rslab, skfem
from papilla.fem import FingerModel, press_finite
from papilla.model.finger import Finger
from papilla.mesh import build
from papilla.model.specimen import Block

def peak():
    lines = open("/proc/self/status").read().splitlines()
    return 1024 * int(next(line.split()[1] for line in lines if line.startswith("VmHWM:")))

job, finger = sys.argv[1], Finger.default()
mesh = build(finger, size_mm=float(sys.argv[2]))
before = peak()
model = FingerModel(finger, mesh)
if job == "finite":
    columns = len(press_finite(finger, mesh, Block(0.51, 10), force=0.2).active)
else:
    columns = len(model.reduce((2.0, 1.0) if job == "off apex" else (0.0, 0.0)).patch.xy)
print(json.dumps([peak() - before, len(model.space.mesh.tets), model.space.unknowns, columns]))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells the peak of a process since its start")
@pytest.mark.parametrize(
    "job, size_mm, law",
    [
        pytest.param("apex", 1.4, reduction_bytes, marks=pytest.mark.slow),
        pytest.param("apex", 0.7, reduction_bytes, marks=pytest.mark.slow),
        pytest.param("off apex", 0.7, lambda *size: reduction_bytes(*size, parities=4), marks=pytest.mark.slow),
        pytest.param("finite", 0.7, finite_bytes, marks=pytest.mark.slow),
    ],
)
def test_the_law_is_what_a_process_takes(job, size_mm, law):
    command = [sys.executable, "-c", MEASURE, job, str(size_mm)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env={**os.environ})
    measured, *size = json.loads(done.stdout)
    assert 1 / MEASURED_MEMORY_RATIO < law(*size) / measured < MEASURED_MEMORY_RATIO


@pytest.fixture
def free(monkeypatch):
    """Set the free memory in bytes."""
    return lambda number: monkeypatch.setattr("papilla.core.seams.free_bytes", lambda: number)


@pytest.mark.parametrize("at, job", [((0.0, 0.0), "factorising"), ((2.0, 1.0), "factorising 4 times")])
def test_a_reduction_is_refused_before_it_starts(at, job, free):
    finger = Finger.default()
    model = FingerModel(finger, build(finger))
    free(int(2e8))
    message = rf"^{job} a mesh of 8,679 tetrahedra \(43,226 unknowns, size_mm 0.7\) needs about [\d.]+ GiB of memory, "
    with pytest.raises(MemoryEstimateError, match=message + r"0.19 GiB are free: mesh with size_mm >= [\d.]+ \("):
        model.reduce(at)


def test_a_press_at_finite_strain_is_refused_before_it_starts(free):
    finger = Finger.default()
    mesh = build(finger)
    free(int(3e8))
    message = r"^pressing at finite strain a mesh of 8,679 tetrahedra .* needs about [\d.]+ GiB of memory, "
    with pytest.raises(MemoryEstimateError, match=message):
        press_finite(finger, mesh, Block(0.51, 10), force=0.1)
