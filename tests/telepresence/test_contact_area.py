"""The commanded contact area: exact on power laws, inside a real sweep, never beyond the table."""

import math

import numpy as np
import pytest

from papilla.core.errors import FileFormatError, InputError
from papilla.telepresence import ContactArea

FORCES, MODULI = np.geomspace(0.05, 1, 7), np.geomspace(0.05, 1, 5)


def law(force, modulus):
    return 60 * force**0.6 * modulus**-0.2


def presses():
    force, modulus = (grid.ravel() for grid in np.meshgrid(FORCES, MODULI))
    return force, modulus, law(force, modulus)


@pytest.mark.parametrize("force, modulus", [(0.05, 0.05), (0.33, 0.21), (1.0, 1.0), (0.051, 0.99)])
def test_a_power_law_is_exact_and_sigma_is_that_of_the_modulus_and_the_mesh(force, modulus):
    area, sigma = ContactArea.of_presses(*presses())(force, modulus, 0.1 * modulus)
    assert area == pytest.approx(law(force, modulus))
    assert sigma / area == pytest.approx(math.hypot(0.01, 0.2 * 0.1))


def test_outside_the_table_and_of_what_is_unknown_there_is_no_area():
    table = ContactArea.of_presses(*presses())
    for force, modulus in ((0.04, 0.1), (1.1, 0.1), (0.5, 0.01), (0.5, 2), (math.nan, 0.1), (0.1, math.nan)):
        assert all(math.isnan(value) for value in table(force, modulus))
    force, modulus, area = presses()
    area[7] = math.nan
    assert math.isnan(ContactArea.of_presses(force, modulus, area)(FORCES[0], MODULI[1])[0])


def test_a_sweep_file_is_read_and_another_refused(tmp_path):
    rows = np.column_stack(presses())
    path = tmp_path / "sweep.csv"
    np.savetxt(path, rows, delimiter=",", header="force_N,modulus_MPa,contact_area_mm2", comments="")
    assert ContactArea.load(path)(0.2, 0.2)[0] == pytest.approx(law(0.2, 0.2))
    np.savetxt(path, rows, delimiter=",", header="force_N,modulus_MPa,g1", comments="")
    with pytest.raises(FileFormatError, match="sweep.csv: no column contact_area_mm2"):
        ContactArea.load(path)
    np.savetxt(path, rows[:1], delimiter=",", header="force_N,modulus_MPa,contact_area_mm2", comments="")
    with pytest.raises(FileFormatError, match=r"sweep.csv: force_N must be two or more"):
        ContactArea.load(path)
    with pytest.raises(InputError, match="moduli x forces"):
        ContactArea(FORCES, MODULI, np.ones((2, 2)))
