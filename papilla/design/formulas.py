"""Formulas of couplings, such as "outer.modulus_MPa / 4".

A formula has numbers, names of parameters, + - * /, minus before a term, ** and the `FORMULA_FUNCTIONS`; nothing else.
Python's parser makes a tree of its text, whose nodes are turned into functions here: no code is compiled, and the same
values always give the same number. All numbers are floats, so a power has bounded operands, and every step must stay
finite."""

import ast
import math
import operator
import warnings
from collections.abc import Callable, Mapping
from functools import lru_cache

from papilla.core.errors import InputError
from papilla.design.texts import line, short

MOST_FORMULA_LETTERS, MOST_FORMULA_NODES, MOST_FORMULA_DEPTH = 2000, 400, 100
"""Most letters of a formula, numbers, names and operations in it, and operations inside each other."""
MOST_ROUND_DIGITS = 15
"""Most digits to which `round` rounds: a float has no more."""

Values = Mapping[str, float]
Step = Callable[[Values], float]

FORMULA_OPERATIONS: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: math.pow,
}


def _rounded(value: float, digits: float = 0.0) -> float:
    if digits not in range(MOST_ROUND_DIGITS + 1):
        raise InputError(f"round takes 0 to {MOST_ROUND_DIGITS} digits, got {digits:g}")
    return round(value, int(digits))


FORMULA_FUNCTIONS: dict[str, tuple[Callable[..., float], range]] = {
    "sqrt": (math.sqrt, range(1, 2)),
    "abs": (abs, range(1, 2)),
    "round": (_rounded, range(1, 3)),
    "min": (min, range(2, MOST_FORMULA_NODES)),
    "max": (max, range(2, MOST_FORMULA_NODES)),
}
"""The functions of formulas, and how many values they take."""


def names_of(formula: str, where: str) -> list[str]:
    """The parameters in a formula, such as "outer.modulus_MPa"; raises `InputError` for what is no formula."""
    try:
        return _read(formula)[1]
    except (InputError, SyntaxError, ValueError, ArithmeticError, MemoryError, RecursionError) as error:
        raise InputError(f"{where}: {short(formula)!r} is no formula ({_reason(error)})") from error


def coupled(values: Values, couplings: Mapping[str, str]) -> dict[str, float]:
    """The values together with those of all couplings, in their order; raises `InputError` for a formula without a
    finite number."""
    together = dict(values)
    for name, formula in couplings.items():
        where = f'couplings."{short(name)}"'
        if missing := next((used for used in names_of(formula, where) if used not in together), None):
            raise InputError(f"{where} = {short(formula)!r}: {short(missing)!r} has no value yet")
        try:
            together[name] = _read(formula)[0](together)
        except (ArithmeticError, ValueError) as error:
            raise InputError(f"{where} = {short(formula)!r}: {_reason(error)}") from error
    return together


def _reason(error: BaseException) -> str:
    if isinstance(error, OverflowError):
        return "a number is too large"
    return short(line(error.args[0] if error.args else ""), 200) or "it is nested too deeply"


@lru_cache(maxsize=1000)
def _read(formula: str) -> tuple[Step, list[str]]:
    """A formula as a function of the values of parameters, and the names that it uses."""
    if len(formula) > MOST_FORMULA_LETTERS:
        raise InputError(f"it has {len(formula)} letters; at most {MOST_FORMULA_LETTERS} are read")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SyntaxWarning)
        tree = ast.parse(formula.strip(), mode="eval")
    count = sum(isinstance(node, ast.expr) for node in ast.walk(tree))
    if count > MOST_FORMULA_NODES:
        raise InputError(f"it has {count} numbers, names and operations; at most {MOST_FORMULA_NODES} are allowed")
    names: list[str] = []
    return _step(tree.body, names, MOST_FORMULA_DEPTH), names


def _step(node: ast.expr, names: list[str], depth: int) -> Step:
    """A node of the tree as a function of the values, which raises `ArithmeticError` unless its number is finite."""
    if not depth:
        raise InputError(f"more than {MOST_FORMULA_DEPTH} operations stand inside each other")
    step = _of(node, names, depth - 1)

    def finite(values: Values) -> float:
        number = step(values)
        if not math.isfinite(number):
            raise OverflowError
        return number

    return finite


def _of(node: ast.expr, names: list[str], depth: int) -> Step:
    match node:
        case ast.Constant(value=value) if type(value) in (int, float):
            number = float(value)  # type: ignore[arg-type]
            return lambda values: number
        case ast.Name() | ast.Attribute() if name := _dotted(node):
            names.append(name)
            return lambda values: float(values[name])
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            negated = _step(operand, names, depth)
            return lambda values: -negated(values)
        case ast.BinOp(left=left, op=sign, right=right) if operation := FORMULA_OPERATIONS.get(type(sign)):
            first, second = _step(left, names, depth), _step(right, names, depth)
            return lambda values: operation(first(values), second(values))
        case ast.Call(func=ast.Name(id=called), args=given, keywords=[]) if called in FORMULA_FUNCTIONS:
            function, counts = FORMULA_FUNCTIONS[called]
            if len(given) not in counts:
                raise InputError(f"{called} takes {counts[0]}{' or more' * (len(counts) > 1)} values, got {len(given)}")
            arguments = [_step(argument, names, depth) for argument in given]
            return lambda values: float(function(*(argument(values) for argument in arguments)))
    allowed = "numbers, names of parameters, + - * / **, " + " ".join(FORMULA_FUNCTIONS)
    raise InputError(f"{short(line(ast.unparse(node)), 30)!r} may not stand in a formula; allowed are {allowed}")


def _dotted(node: ast.expr) -> str:
    """The name of a parameter, such as "outer.nu"; empty for anything else with a dot."""
    if isinstance(node, ast.Attribute):
        before = _dotted(node.value)
        return f"{before}.{node.attr}" if before else ""
    return node.id if isinstance(node, ast.Name) else ""
