"""Memory of a model: the law against what a process really takes, and refusals before anything is factorised."""

import json
import subprocess
import sys
from functools import partial

import pytest

from papilla.core.errors import MemoryEstimateError
from papilla.core.memory import MEASURED_MEMORY_RATIO, finite_bytes, reduction_bytes
from papilla.fem import FingerModel, press_finite
from papilla.mesh import build
from papilla.model.finger import Finger
from papilla.model.specimen import Block

MEASURE = """
import json, resource, sys
import rslab, skfem
from papilla.fem import FingerModel, press_finite
from papilla.model.finger import Finger
from papilla.mesh import build
from papilla.model.specimen import Block

def peak():
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

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


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells the peak of a process in kB")
@pytest.mark.parametrize(
    "job, size_mm, law",
    [
        ("apex", 1.4, reduction_bytes),
        ("off apex", 0.7, partial(reduction_bytes, parities=4)),
        ("finite", 0.7, finite_bytes),
    ],
)
def test_the_law_is_what_a_process_takes(job, size_mm, law):
    command = [sys.executable, "-c", MEASURE, job, str(size_mm)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    measured, *size = json.loads(done.stdout)
    assert 1 / MEASURED_MEMORY_RATIO < law(*size) / measured < MEASURED_MEMORY_RATIO


@pytest.mark.parametrize("at, job", [((0.0, 0.0), "factorising"), ((2.0, 1.0), "factorising 4 times")])
def test_a_reduction_is_refused_before_it_starts(at, job, monkeypatch):
    finger = Finger.default()
    model = FingerModel(finger, build(finger))
    monkeypatch.setattr("papilla.core.seams.free_bytes", lambda: int(2e8))
    message = rf"^{job} a mesh of 8,679 tetrahedra \(43,226 unknowns, size_mm 0.7\) needs about [\d.]+ GiB of memory, "
    with pytest.raises(MemoryEstimateError, match=message + r"0.19 GiB are free: mesh with size_mm >= [\d.]+ \("):
        model.reduce(at)
    message = r"^pressing at finite strain a mesh of 8,679 tetrahedra .* needs about [\d.]+ GiB of memory, "
    with pytest.raises(MemoryEstimateError, match=message):
        press_finite(finger, model.mesh, Block(0.51, 10), force=0.1)
