"""Runs the families of cases one after the other, and keeps going where one of them stops."""

from collections.abc import Callable, Mapping, Sequence
from time import perf_counter

from papilla.errors import InputError, PapillaError
from papilla.studies.verify.case import Case, Family
from papilla.studies.verify.registry import FAMILIES


def verify(
    only: Sequence[str] = (),
    *,
    progress: Callable[[Case, int, int], None] | None = None,
    families: Mapping[str, Family] = FAMILIES,
) -> list[Case]:
    """Run all families of cases, or those named in `only`; a case's name starts with its family's.

    `progress` is called after each case with the case, how many families are done, and how many there are. A family
    that ends in an error of papilla leaves a case that failed and says so. Raises `InputError` for an unknown name.
    """
    unknown = [name for name in only if name not in families]
    if unknown:
        raise InputError(f"no family of cases is called {unknown[0]!r}: expected {', '.join(families)}")
    wanted = [name for name in families if not only or name in only]
    cases = []
    for done, name in enumerate(wanted):
        for case in _run(name, families[name]):
            cases.append(case)
            if progress is not None:
                progress(case, done, len(wanted))
    return cases


def _run(name: str, family: Family):
    began = perf_counter()
    try:
        for check in family():
            now = perf_counter()
            yield Case(f"{name}: {check.name}", check.measure, check.error, check.bound, now - began)
            began = now
    except PapillaError as error:
        message = " ".join(str(error).split())
        yield Case(f"{name}: stopped", f"no error expected, got: {message}", float("inf"), 0.0, perf_counter() - began)
