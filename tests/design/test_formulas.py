"""Formulas of couplings: the numbers that they give, and all that they refuse."""

import math
import time

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.design.formulas import coupled, names_of

AT_ONCE_S = 1.0


def value_of(formula, **values):
    """The number of a formula."""
    return coupled(values, {"result": formula})["result"]


def drawn(rng, depth):
    """A formula, and its number by Python's own arithmetic."""
    kind = rng.integers(0, 8) if depth else 0
    if kind == 0:
        number = float(f"{rng.uniform(0.5, 4):.3f}")
        return rng.choice([(str(number), number), ("a.b_mm", 2.5), ("x", 0.75)]) if rng.random() < 0.5 else (
            str(number), number)  # fmt: skip
    (first, one), (second, other) = drawn(rng, depth - 1), drawn(rng, depth - 1)
    one, other = float(one), float(other)
    return [
        (f"({first} + {second})", one + other), (f"({first} - {second})", one - other),
        (f"({first} * {second})", one * other), (f"(-{first})", -one), (f"abs({first})", abs(one)),
        (f"max({first}, {second})", max(one, other)), (f"sqrt(abs({first}))", math.sqrt(abs(one))),
        (f"(2 ** min({first}, 3))", 2.0 ** min(one, 3.0)),
    ][kind]  # fmt: skip


@pytest.mark.parametrize("seed", range(60))
def test_a_formula_has_the_number_of_arithmetic_each_time(seed):
    formula, number = drawn(np.random.default_rng(seed), 4)
    values = {"a.b_mm": 2.5, "x": 0.75}
    first, again = (coupled(values, {"result": formula})["result"] for _ in range(2))
    assert first == again == pytest.approx(float(number), rel=1e-12)


def test_precedence_and_functions():
    numbers = {"-x ** 2": -0.5625, "round(7 / 4)": 2.0, "round(x / 2, 2)": 0.38, "min(3, x, 2)": 0.75, "1_000 * x": 750}
    assert {formula: value_of(formula, x=0.75) for formula in numbers} == pytest.approx(numbers)


def test_couplings_follow_each_other_and_say_which_name_has_no_value():
    formulas = {"inner.modulus_MPa": "outer.modulus_MPa / 4", "x": "sqrt(inner.modulus_MPa * 2)"}
    assert coupled({"outer.modulus_MPa": 8.0}, formulas)["x"] == 2.0
    with pytest.raises(InputError, match=r"'inner\.modulus_MPa' has no value yet"):
        coupled({"outer.modulus_MPa": 8.0}, dict(reversed(formulas.items())))
    assert names_of("max(outer.nu, 2 * shape.bone.z_mm) - x", "here") == ["outer.nu", "shape.bone.z_mm", "x"]


@pytest.mark.parametrize(
    "formula",
    [
        "rand()", "0.03 + 0.04 * rand()", "randint(3)", "int(x)", "float(x)", "str(x)", "'text'", "b'text'", "f'{x}'",
        "True", "None", "...", "1j", "x < 2", "x == x", "x and 2", "not x", "x if x else x", "x // 2", "x % 2",
        "x @ x", "x | 2", "x << 2", "~x", "[x]", "(x, x)", "{x}", "[y for y in x]", "(y for y in x)", "lambda: x",
        "x[0]", "x()", "x.real()", "(1).real", "().__class__", "sqrt(x).real", "sqrt(value=x)", "max(*x)",
        "sqrt(x, x)", "min(x)", "(y := 2)", "await x", "__import__('os').getcwd()", "", "x +", "x; x", "x = 2", "x\0",
        "round(x, 0.5)", "round(x, 99)", "eval(x)",
    ],
)  # fmt: skip
def test_nothing_else_stands_in_a_formula(formula):
    with pytest.raises(InputError) as refused:
        value_of(formula, x=0.75)
    assert "\n" not in str(refused.value) and len(str(refused.value)) < 500


@pytest.mark.parametrize(
    "formula", ["1 / 0", "sqrt(-1)", "(-2) ** 0.5", "0 ** -1", "1e999", "1e308 * 10", "1 / (1e308 * 10)", "10 ** 400"]
)
def test_every_step_has_a_finite_number(formula):
    with pytest.raises(InputError, match="result"):
        value_of(formula)


@pytest.mark.parametrize(
    "formula",
    ["4000000**4000000", "9**9**9**9**9", "x**x**x**x**x**x", "+".join(["x"] * 20_000), "-" * 100_000 + "x",
     "(" * 50_000 + "x" + ")" * 50_000, "x" + ".x" * 50_000, "9" * 100_000, "min(" * 1000 + "x" + ", 1)" * 1000,
     "x" * 1_000_000, "*".join(["1e200"] * 50), "sqrt(" * 380 + "x" + ")" * 380, "x" + ".x" * 900],
)  # fmt: skip
def test_size_is_bounded_at_once(formula):
    began = time.perf_counter()
    with pytest.raises(InputError) as refused:
        value_of(formula, x=9e9)
    assert time.perf_counter() - began < AT_ONCE_S
    assert "\n" not in str(refused.value) and len(str(refused.value)) < 500
