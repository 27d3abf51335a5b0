"""The families of cases of `papilla verify`, in the order of the table, and how they are run."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from time import perf_counter

from papilla.errors import InputError, MissingExtraError, PapillaError
from papilla.studies.verify.adhesion import adhesion
from papilla.studies.verify.case import Case, Family
from papilla.studies.verify.creep import creep
from papilla.studies.verify.engines import engines
from papilla.studies.verify.friction import friction
from papilla.studies.verify.hard import contrast, loads, places, slivers, thin_layer
from papilla.studies.verify.hertz import coat, hertz, layers
from papilla.studies.verify.identification import identification
from papilla.studies.verify.incompressible import incompressible
from papilla.studies.verify.invariance import invariance
from papilla.studies.verify.manufactured import manufactured
from papilla.studies.verify.moved import moved
from papilla.studies.verify.patch_test import patch_test
from papilla.studies.verify.revolution import revolution
from papilla.studies.verify.scatter import scatter
from papilla.studies.verify.sliding import sliding

FAMILIES: dict[str, Family] = {
    "patch": patch_test,
    "manufactured": manufactured,
    "hertz": hertz,
    "layer": layers,
    "coat": coat,
    "friction": friction,
    "adhesion": adhesion,
    "creep": creep,
    "sliding": sliding,
    "incompressible": incompressible,
    "contrast": contrast,
    "loads": loads,
    "places": places,
    "thin-layer": thin_layer,
    "slivers": slivers,
    "revolution": revolution,
    "scatter": scatter,
    "moved": moved,
    "invariance": invariance,
    "engines": engines,
    "identification": identification,
}


def verify(
    only: Sequence[str] = (),
    *,
    progress: Callable[[Case, int, int], None] = lambda case, done, total: None,
    skipped: Callable[[str], None] = lambda sentence: None,
    families: Mapping[str, Family] = FAMILIES,
) -> list[Case]:
    """Run all families of cases, or those named in `only`; a case's name starts with its family's.

    `progress` is called after each case with the case, how many families are done, and how many there are. A family
    that ends in an error of papilla leaves a case that failed and says so; one that needs a package that is absent is
    left out, and `skipped` is called with a sentence. Raises `InputError` for an unknown name.
    """
    unknown = [name for name in only if name not in families]
    if unknown:
        raise InputError(f"no family of cases is called {unknown[0]!r}: expected {', '.join(families)}")
    wanted = [name for name in families if not only or name in only]
    cases = []
    for done, name in enumerate(wanted):
        for case in _run(name, families[name], skipped):
            cases.append(case)
            progress(case, done, len(wanted))
    return cases


def _run(name: str, family: Family, skipped: Callable[[str], None]) -> Iterator[Case]:
    began = perf_counter()
    try:
        for case in family():
            now = perf_counter()
            yield replace(case, name=f"{name}: {case.name}", seconds=now - began)
            began = now
    except MissingExtraError as error:
        skipped(f"{name}: skipped, {error}")
    except PapillaError as error:
        message = " ".join(str(error).split())
        yield Case(f"{name}: stopped", f"no error expected, got: {message}", float("inf"), 0.0, perf_counter() - began)
