"""What to press next: against every other choice, and against what a fit then knows."""

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.fem.pressing.response import response
from papilla.fem.reduction.family import family
from papilla.identification import identify
from papilla.identification.suggest import suggest_presses
from papilla.logs import PressLog
from papilla.model.finger import Finger
from papilla.model.specimen import Block

SIZE_MM = 2.8
MODULI, FORCES = (0.089, 0.72), (0.1, 0.4, 0.9)


@pytest.fixture(scope="module")
def told():
    """What presses of the default geometry measure."""
    return response(family(Finger.default(), size_mm=SIZE_MM), Block(1.0, 10.0))


@pytest.fixture(scope="module")
def identified(told):
    """A finger identified from six presses."""
    force, modulus = np.array([0.1, 0.2, 0.3, 0.5, 0.7, 0.9]), np.array([0.089, 0.51] * 3)
    felt = told.felt(force, modulus, 0.15, 0.03).values
    reading = 1e6 * (0.3 * felt[:, 0] - 0.2 * felt[:, 1]) + 10
    noise = np.random.default_rng(3).normal(0, 5, reading.shape)
    log = PressLog(force, modulus, reading + noise, ("g1", "g2", "g3", "g4", "g5"))
    return identify(log, Finger.default(), size_mm=SIZE_MM)


@pytest.mark.parametrize(
    "count, moduli, options, message",
    [
        (0, MODULI, {}, "number of presses to suggest must be at least 1, got 0"),
        (True, MODULI, {}, "at least 1, got True"),
        (2, (), {}, "at least one force and one modulus"),
        (2, (0.1, -1.0), {}, r"modulus \(MPa\) to press must be greater than 0"),
        (2, MODULI, {"forces": (0.0,)}, r"force \(N\) to press must be greater than 0"),
        (2, MODULI, {"criterion": "A"}, "criterion must be I or D, got 'A'"),
    ],
)
def test_what_cannot_be_suggested_is_refused(count, moduli, options, message):
    with pytest.raises(InputError, match=message):
        suggest_presses(Finger.default(), count, moduli, **options)
