"""A self-test of the installation: a few checks that take seconds, for `papilla doctor`."""

import os
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from time import perf_counter

from papilla import fem
from papilla.core import cache
from papilla.core.files import scratch
from papilla.model.finger import Finger
from papilla.model.specimen import Block
from papilla.verify.case import Case
from papilla.verify.elements import exact_fields

TEST_MESH_SIZE_MM, TEST_PRESS = 2.0, (Block(0.51, 10.0), 0.588)
"""Mesh, specimen and force (N) of the press: a coarse mesh, and the press that pictures show."""
HERTZ_DIFFERENCE, FORCE_BALANCE = 0.03, 1e-9
"""Bounds, as fractions: difference of `hertz` from `contact` on a coarse mesh, and force balance of a press."""


def self_test() -> list[Case]:
    """Exact solutions, and a press of the default finger by two methods, computed without the cache."""
    began, cases = perf_counter(), []
    for case in chain(exact_fields(), _press()):
        now = perf_counter()
        cases.append(replace(case, seconds=now - began))
        began = now
    return cases


def _press() -> Iterator[Case]:
    before = os.environ.get(cache.CACHE_VARIABLE)
    with scratch("self-test") as place:
        os.environ[cache.CACHE_VARIABLE] = str(place)
        try:
            reduced = fem.prepare(Finger.default(), size_mm=TEST_MESH_SIZE_MM)
        finally:
            os.environ.pop(cache.CACHE_VARIABLE)
            if before is not None:
                os.environ[cache.CACHE_VARIABLE] = before
    specimen, force = TEST_PRESS
    contact, hertz = (fem.press(reduced, specimen, force=force, fidelity=name) for name in ("contact", "hertz"))
    yield Case("press, force", "integral of the pressure against the force", contact.force_balance, FORCE_BALANCE)
    yield Case("press, S_d", "contact against Hertz", abs(contact.sd / hertz.sd - 1), HERTZ_DIFFERENCE)
