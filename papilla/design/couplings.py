"""Couplings of a study: parameters that a formula computes from others. simpleeval evaluates the formula, never
`eval`."""

import ast
import re
from collections.abc import Iterable, Mapping

from simpleeval import DEFAULT_FUNCTIONS, InvalidExpression, SimpleEval

from papilla.design.parameters import refuse_unknown
from papilla.errors import InputError

NAME = re.compile(r"(?<![\w.])[^\W\d]\w*(?:\.\w+)*(?!\s*\(|[\w.])")
"""A name with dots that is neither a function nor part of a number."""
FUNCTIONS = {"sqrt": lambda value: value**0.5, "min": min, "max": max, "abs": abs, "round": round}


def check(couplings: Mapping[str, str], known: Iterable[str]) -> None:
    """Raise `InputError` for a formula that cannot be parsed, or that contains an unknown name."""
    for name, formula in couplings.items():
        where = f'couplings."{name}"'
        for used in names_of(formula, where):
            refuse_unknown(used, known, where)


def names_of(formula: str, where: str) -> list[str]:
    """The parameters in a formula, such as "outer.modulus_MPa"."""
    try:
        ast.parse(formula.strip(), mode="eval")
    except (SyntaxError, ValueError) as error:
        raise InputError(f"{where}: {formula!r} is no formula ({error})") from error
    return NAME.findall(formula)


def coupled(values: Mapping[str, float], couplings: Mapping[str, str]) -> dict[str, float]:
    """The values together with those of all couplings, in their order; raises `InputError` for a formula without a
    number."""
    found = dict(values)
    for name, formula in couplings.items():
        evaluator = SimpleEval(functions={**DEFAULT_FUNCTIONS, **FUNCTIONS}, names=_nested(found))
        try:
            found[name] = float(evaluator.eval(formula))
        except (InvalidExpression, ArithmeticError, TypeError, ValueError, KeyError) as error:
            raise InputError(f'couplings."{name}" = {formula!r}: {error}') from error
    return found


def _nested(values: Mapping[str, float]) -> dict:
    """Values with dotted names, as nested tables."""
    tables: dict = {}
    for name, value in values.items():
        *folders, last = name.split(".")
        table = tables
        for folder in folders:
            table = table.setdefault(folder, {})
        table[last] = value
    return tables
