"""What to press next: against every other choice, and against what a fit then knows."""

import pytest

from papilla.core.errors import InputError
from papilla.identification.suggest import suggest_presses
from papilla.model.finger import Finger

SIZE_MM, MODULI = 2.8, (0.089, 0.72)


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
