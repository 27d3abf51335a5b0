"""Direct feedback, harmonics of a grating, oscillators of the local model, strictness of messages: closed forms."""

import math

import msgspec
import pytest

from papilla.telepresence import GratingTexture
from papilla.telepresence.actuator import Safety
from papilla.telepresence.direct import DirectFeedback
from papilla.telepresence.local_model import DisplayStatus
from papilla.telepresence.messages import Force, Length, Modulus, Ratio
from papilla.telepresence.touch import GRATING_HARMONICS, PASS_BAND_HZ, SKIN_MM

STEP_S = 1e-3


def test_the_display_fades_in_holds_the_last_reading_and_falls_silent_when_readings_stop():
    feedback = DirectFeedback(um_per_microstrain=0.1, safety=Safety(hold_s=0.05, decay_s=0.02, attack_s=0.01))
    assert feedback.update(0.0).status == DisplayStatus.NO_MESSAGE
    feedback.take_reading(0.0, 100.0)
    feedback.take_reading(0.0, math.nan)
    rows = [feedback.update(number * STEP_S) for number in range(1, 100)]
    # Full after 10 ms, kept until 50 ms after the reading, then down to zero within 20 ms
    assert [row.displacement_um for row in rows[:12]] == pytest.approx([min(10.0, k) for k in range(1, 13)])
    assert all(row.status == DisplayStatus.OK for row in rows[:50]) and rows[49].displacement_um == 10.0
    assert [row.displacement_um for row in rows[50:72]] == pytest.approx([max(0, 10 - 0.5 * k) for k in range(1, 23)])
    assert rows[60].status == DisplayStatus.STALLED


def test_a_clock_that_jumps_moves_the_gain_by_five_milliseconds_at_most_and_the_stroke_cuts():
    feedback = DirectFeedback(um_per_microstrain=1.0, safety=Safety(attack_s=0.1))
    feedback.take_reading(0.0, 1e4)
    feedback.update(0.0)
    jumped = feedback.update(0.4)
    assert jumped.gain == pytest.approx(0.05)
    assert jumped.displacement_um == feedback.actuator.amplitude_um and jumped.status == DisplayStatus.CLIPPED


@pytest.mark.parametrize("wavelength", [0.6, 1.5])
def test_harmonics_of_a_grating_are_a_square_waves_smoothed_by_the_skin(wavelength):
    texture = GratingTexture(wavelength, 40.0)
    for place in (0.0, 0.2, 0.31):
        expected = 0.0
        for n, sign in zip(GRATING_HARMONICS, (1, -1, 1), strict=True):
            # A Gaussian of width SKIN_MM multiplies wavenumber k by exp(-(k s)^2 / 2), relative to the fundamental
            wide = [math.exp(-0.5 * (2 * math.pi * m * SKIN_MM / wavelength) ** 2) for m in (n, 1)]
            expected += sign / n * wide[0] / wide[1] * math.cos(2 * math.pi * n * place / wavelength)
        assert texture.reading(place, 10.0) == pytest.approx(40.0 * expected)
    fast = 0.9 * PASS_BAND_HZ * wavelength
    assert texture.reading(0.1, fast) == pytest.approx(40.0 * math.cos(2 * math.pi * 0.1 / wavelength))


@pytest.mark.parametrize("kind", [Length, Modulus, Ratio, Force])
def test_a_quantity_with_a_field_too_many_is_refused(kind):
    encoded = msgspec.msgpack.encode(kind(1.0, 0.1, 0))
    fields = msgspec.msgpack.decode(encoded)
    assert msgspec.msgpack.decode(encoded, type=kind) == kind(1.0, 0.1, 0)
    with pytest.raises(msgspec.ValidationError):
        msgspec.msgpack.decode(msgspec.msgpack.encode([*fields, 1]), type=kind)


def test_the_former_name_of_take_reading_warns_and_does_the_same():
    feedback = DirectFeedback()
    with pytest.warns(DeprecationWarning, match="take_reading"):
        feedback.hear(0.0, 100.0)
    feedback.update(0.0)
    assert feedback.update(0.01).displacement_um > 0
