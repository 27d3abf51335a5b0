"""Memory of a model: the law against what a process really takes, and refusals before anything is factorised."""

import pytest

from papilla.core.errors import MemoryEstimateError
from papilla.fem import FingerModel, press_finite
from papilla.mesh import build
from papilla.model.finger import Finger
from papilla.model.specimen import Block


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
