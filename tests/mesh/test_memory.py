"""Meshes that could not be used are refused before the mesher runs, with a size that could."""

import re

import pytest

from papilla.core.errors import MemoryEstimateError
from papilla.mesh import build
from papilla.mesh.sizing import asked
from papilla.model.finger import Finger

GB = 1e9


def refuse(size_mm, finger=None):
    asked(finger or Finger.default(), size_mm)


@pytest.mark.parametrize("left", [1 * GB, 8 * GB, 64 * GB])
def test_the_size_that_is_named_would_fit_and_a_finer_one_would_not(left, free):
    free(left)
    with pytest.raises(MemoryEstimateError) as refused:
        refuse(0.1)
    size = float(re.search(r": mesh with size_mm >= ([\d.]+) \(--size-mm of ", str(refused.value)).group(1))
    refuse(size)
    with pytest.raises(MemoryEstimateError):
        refuse(0.93 * size)


def test_the_mesher_is_not_even_started(free, no_mesher):
    free(16 * GB)
    message = r"^factorising a mesh of about \d,\d{3},\d{3} tetrahedra \(size_mm 0.1\) needs about \d+ GiB of memory, "
    with pytest.raises(MemoryEstimateError, match=message + r"15 GiB are free: mesh with size_mm >= 0.\d+ \("):
        build(Finger.default(), 0.1)
