"""Validation at the boundary: what passes, what does not, and the one line that says so."""

import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from papilla.core import checks
from papilla.core.errors import InputError


@pytest.mark.parametrize("value", [2, 2.0, np.float32(2), np.int64(2), np.array(2.0), Fraction(4, 2), Decimal(2)])
def test_numbers_of_any_kind_become_floats(value):
    for found in (checks.finite("x", value), checks.positive("x", value), checks.within("x", value, 0, 2)):
        assert type(found) is float and found == 2.0


@pytest.mark.parametrize(
    "value",
    ["2", "", None, True, False, [1.0], {}, object(), 1j, np.array([1.0, 2.0])],
    ids=lambda value: type(value).__name__,
)
@pytest.mark.parametrize("check", [checks.finite, checks.positive, checks.poisson])
def test_what_is_no_number_is_refused(check, value):
    with pytest.raises(InputError, match="^the modulus must be a number, got ") as caught:
        check("the modulus", value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, np.float64("nan")])
@pytest.mark.parametrize("check", [checks.finite, checks.positive, checks.poisson])
def test_what_is_not_finite_is_refused(check, value):
    with pytest.raises(InputError, match=f"^x must be finite, got {value}$"):
        check("x", value)


def test_a_whole_number_too_large_for_a_float_is_refused():
    with pytest.raises(InputError, match="^x must be a number, got 1000"):
        checks.finite("x", 10**400)


@pytest.mark.parametrize("value, shown", [(0, "0"), (0.0, "0"), (-0.0, "-0"), (-1e-300, "-1e-300"), (-3, "-3")])
def test_positive_means_more_than_zero(value, shown):
    with pytest.raises(InputError, match=f"^x must be greater than 0, got {shown}$"):
        checks.positive("x", value)
    assert checks.finite("x", value) == value
    assert checks.positive("x", 5e-324) > 0


def test_intervals_are_closed():
    assert checks.within("x", 1, 1, 2) == 1 and checks.within("x", 2, 1, 2) == 2
    for value in (np.nextafter(1, 0), np.nextafter(2, 3)):
        with pytest.raises(InputError, match="^x must lie between 1 and 2, got "):
            checks.within("x", value, 1, 2)


@pytest.mark.parametrize("nu", [-1e-9, 0.5000001, 1])
def test_poissons_ratio_ends_at_one_half(nu):
    assert checks.poisson("nu", 0) == 0 and checks.poisson("nu", 0.5) == 0.5
    with pytest.raises(InputError, match="^nu must lie between 0 and 0.5, got "):
        checks.poisson("nu", nu)


def test_only_what_a_sensor_can_give_is_believed():
    found = checks.believable(np.array([1e12, -1e12, 1.01e12, -1e300, np.inf, np.nan, 0.0]))
    np.testing.assert_array_equal(found, [1e12, -1e12, np.nan, np.nan, np.nan, np.nan, 0.0])


def test_a_range_rises():
    assert checks.rising("range", (np.float32(1), 3)) == (1.0, 3.0)
    with pytest.raises(InputError, match="^range must rise, got 3 and 1$"):
        checks.rising("range", (3, 1))
    with pytest.raises(InputError, match="^range must be two numbers .low, high., got 3$"):
        checks.rising("range", 3)
    with pytest.raises(InputError, match="^range .low end. must be greater than 0, got 0$"):
        checks.rising("range", (0, 1))


@pytest.mark.parametrize("given", [(1.0,), (1, 2, 3), None, 3])
def test_a_place_is_two_numbers(given):
    assert checks.place("at", np.array([1.0, -2.0])) == (1.0, -2.0)
    with pytest.raises(InputError, match="^at must be two numbers .x, y. in mm, got "):
        checks.place("at", given)


def test_a_name_is_a_line_that_can_be_printed():
    for text in ("a", "x" * checks.LONGEST_NAME_LETTERS, "Größe 2\u00a0mm", "指 №4"):
        assert checks.name("finger", text) == text
    for text, said in (("", "got 0 letters"), ("x" * 201, "1 to 200 letters, got 201 letters"), (3, "got 3"),
                       ("a\nb", "cannot be printed"), ("a\u202eb", "cannot be printed")):  # fmt: skip
        with pytest.raises(InputError, match=f"^finger .*{said}"):
            checks.name("finger", text)


def test_the_square_of_a_place_is_finite():
    assert checks.place("at", (1e12, -1e12)) == (1e12, -1e12)
    for far, letter in (((1.01e12, 0), "x"), ((0, -1.01e12), "y"), ((-1.01e12, 0), "x")):
        with pytest.raises(InputError, match=rf"^at {letter} .mm. must lie between -1e\+12 and 1e\+12"):
            checks.place("at", far)
