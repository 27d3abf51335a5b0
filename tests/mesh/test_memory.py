"""Meshes that could not be used are refused before the mesher runs, with a size that could."""

import re

import pytest

from papilla.core import memory
from papilla.core.errors import MemoryEstimateError
from papilla.mesh import build
from papilla.mesh.sizing import asked
from papilla.model.finger import Finger, Layer

GB = 1e9

# Tetrahedra of the quarter cell of the default finger, as the mesher made them; 0.7 mm is the shipped mesh
MADE = {2.0: 2618, 1.4: 4329, 1.0: 5290, 0.7: 8679, 0.5: 18877, 0.35: 52958, 0.25: 146068}


def refuse(size_mm, finger=None):
    asked(finger or Finger.default(), size_mm)


@pytest.mark.slow
@pytest.mark.parametrize("size_mm", MADE)
def test_the_number_of_tetrahedra_is_foreseen(size_mm, free):
    free(1)
    with pytest.raises(MemoryEstimateError, match="no coarser mesh would fit") as refused:
        refuse(size_mm)
    expected = int(re.search(r"about ([\d,]+) tetrahedra", str(refused.value)).group(1).replace(",", ""))
    assert expected == pytest.approx(MADE[size_mm], rel=0.22)


def test_the_shipped_mesh_is_the_one_that_was_counted():
    assert len(build(Finger.default()).cell().tets) == MADE[0.7]


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


@pytest.mark.slow
def test_a_meshed_bone_counts(free):
    from dataclasses import replace

    free(1)
    numbers = []
    for finger in (Finger.default(), replace(Finger.default(), bone=Layer(3000.0, 0.35))):
        with pytest.raises(MemoryEstimateError) as refused:
            refuse(0.5, finger)
        numbers.append(int(re.search(r"about ([\d,]+)", str(refused.value)).group(1).replace(",", "")))
    assert numbers[1] > numbers[0]


def test_the_law_grows_as_nested_dissection_does():
    assert memory.least_bytes(1e9) / memory.least_bytes(1e8) == pytest.approx(10 ** (4 / 3), rel=0.05)


def test_the_size_that_would_do_is_rounded_up(free):
    free(11)
    with pytest.raises(MemoryEstimateError, match="a job needs about .*: mesh with size_mm >= 4.6 "):
        memory.refuse_size("a job", 0.5, lambda ratio: 100 / ratio)
