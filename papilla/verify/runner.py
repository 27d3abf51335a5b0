"""The families of cases of `papilla verify`, in the order of the table, and how they are run."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from time import perf_counter

from papilla.core.errors import InputError, MissingExtraError, PapillaError
from papilla.core.progress import Progress, silent
from papilla.verify.case import Case
from papilla.verify.contact import coat, friction, hertz, layers
from papilla.verify.elements import manufactured, patch_test
from papilla.verify.hard import contrast, engines, incompressible, loads, places
from papilla.verify.identification import identification
from papilla.verify.invariance import invariance
from papilla.verify.jobs import run_jobs
from papilla.verify.meshes import moved, scatter, slivers, thin_layer
from papilla.verify.revolution import revolution
from papilla.verify.sliding import sliding

Family = Callable[[], Iterator[Case]]
"""A family of cases: a generator of cases that share expensive results."""

# The longest come early, so that none of them is left for the end with two processes
CASE_FAMILIES: dict[str, Family] = {
    "patch": patch_test,
    "manufactured": manufactured,
    "hertz": hertz,
    "identification": identification,
    "revolution": revolution,
    "layer": layers,
    "coat": coat,
    "friction": friction,
    "sliding": sliding,
    "incompressible": incompressible,
    "contrast": contrast,
    "loads": loads,
    "places": places,
    "thin-layer": thin_layer,
    "slivers": slivers,
    "scatter": scatter,
    "moved": moved,
    "invariance": invariance,
    "engines": engines,
}


def verify(
    only: Sequence[str] = (),
    *,
    processes: int = 1,
    progress: Progress = silent,
    skipped: Callable[[str], None] = lambda sentence: None,
    families: Mapping[str, Family] = CASE_FAMILIES,
) -> list[Case]:
    """Run all families of cases, or those named in `only`; what a case is called starts with its family's name.

    processes : families that run at once, each in a new process, which frees its memory at its end; 1 runs them here.
    `progress` is told the case that is done, with how many families are done of how many. A family that
    ends in an error of papilla leaves a case that failed and says so; one that needs a package that is absent is left
    out, and `skipped` is called with a sentence. Raises `InputError` for an unknown name.
    """
    unknown = [name for name in only if name not in families]
    if unknown:
        raise InputError(f"no family of cases is called {unknown[0]!r}: expected {', '.join(families)}")
    jobs = {name: (name, families[name]) for name in families if not only or name in only}
    cases = []
    for name, cases_of in run_jobs(_run, jobs, processes=processes, fresh=True, progress=progress):
        if isinstance(cases_of, str):
            skipped(f"{name}: skipped, {cases_of}")
        else:
            cases += cases_of
    return cases


def _run(name: str, family: Family, progress: Progress) -> list[Case] | str:
    """The cases of a family, or the package that it lacks."""
    cases: list[Case] = []
    began = perf_counter()
    try:
        for case in family():
            now = perf_counter()
            cases.append(replace(case, what=f"{name}: {case.what}", seconds=now - began))
            progress(cases[-1].what.split(":")[0])
            began = now
    except MissingExtraError as error:
        return str(error)
    except PapillaError as error:
        cause = f"no error expected, got: {' '.join(str(error).split())}"
        cases.append(Case(f"{name}: stopped", cause, float("inf"), 0.0, perf_counter() - began))
    return cases
