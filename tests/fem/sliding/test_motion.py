"""The motion of a sliding scene: even samples of what was given, and what is refused."""

import numpy as np
import pytest

from papilla import Grating
from papilla.core.errors import FileFormatError, InputError
from papilla.fem import Motion
from papilla.fem.sliding.felt_profile import FeltProfile


def test_a_steady_motion_has_even_times_from_0_and_its_speed():
    motion = Motion.steady(-36.0, 0.5, 200.0)
    assert motion.t_s == pytest.approx(np.arange(100) / 200) and motion.rate_Hz == 200
    assert motion.position_mm == pytest.approx(-36 * motion.t_s) and motion.velocity_mm_s == pytest.approx(-36.0)
    assert motion.fastest_mm_s == pytest.approx(36.0)


def test_a_sampled_motion_is_straight_between_its_points_and_begins_at_0():
    motion = Motion.sampled([2.0, 2.1, 2.3], [5.0, 6.0, 4.0], 100.0)
    assert len(motion.t_s) == 30 and motion.t_s[0] == 0
    expected = np.where(motion.t_s <= 0.1, 5 + 10 * motion.t_s, 6 - 10 * (motion.t_s - 0.1))
    assert motion.position_mm == pytest.approx(expected)
    assert len(Motion.sampled([2.0, 2.1, 2.3], [5.0, 6.0, 4.0], 100.0, 0.1).t_s) == 10, "a part of it"
    assert len(Motion.sampled([2.0, 2.1, 2.3], [5.0, 6.0, 4.0], 100.0, 0.3).t_s) == 30, "all of it"


@pytest.mark.parametrize(
    "t, x, seconds, message",
    [
        ([0.0], [0.0], None, "two points at least, got 1 times and 1 places"),
        ([0, 1, 2], [0, np.nan, 1], None, "point 2 of the motion is not finite"),
        ([0, 1, 1], [0, 1, 2], None, "point 3 does not"),
        ([0, 1, 2, 3, 9], [0] * 5, None, "a gap from t_s 3 to 9"),
        ([0, 1, 2], [0, 1, 10_002], None, "faster than 10 m/s"),
        ([0, 1, 2], [0, 1, 2], 2.001, "seconds 2.001 is longer than the motion, 2 s"),
        ([5, 6, 7], [0, 1, 2], 2.001, "seconds 2.001 is longer than the motion, 2 s"),
        ([0, 1, 2], [0, 1, 2], -1.0, "seconds must be greater than 0"),
    ],
)
def test_a_motion_that_is_none_is_refused(t, x, seconds, message):
    with pytest.raises(InputError, match=message):
        Motion.sampled(t, x, 100.0, seconds)


def test_scenes_have_two_samples_to_two_million():
    for seconds, message in ((2001.0, "2001 s at 1000 Hz are more than 2,000,000 "), (0.001, "fewer than two samples")):
        with pytest.raises(InputError, match=message):
            Motion.steady(1.0, seconds)
    assert len(Motion.steady(1.0, 2000.0).t_s) == 2_000_000 and len(Motion.steady(1.0, 0.002).t_s) == 2


def test_a_file_is_read_and_its_faults_are_named(tmp_path):
    path = tmp_path / "motion.csv"
    path.write_text("note,t_s,position_mm\na,0,0\nb,0.5,3\nc,1,0\n")
    assert Motion.read(path, 10.0).position_mm == pytest.approx([0, 0.6, 1.2, 1.8, 2.4, 3, 2.4, 1.8, 1.2, 0.6])
    assert len(Motion.read(path, 10.0, 0.5).t_s) == 5
    path.write_text("t_s,place\n0,0\n1,1\n")
    with pytest.raises(FileFormatError, match=r"motion.csv, line 1: column position_mm is missing \(found t_s, place"):
        Motion.read(path)
    path.write_text("t_s,position_mm\n0,0\n0,1\n")
    with pytest.raises(FileFormatError, match="motion.csv: times of a motion must rise"):
        Motion.read(path)


class Sine:
    """A texture of one wavelength that rises and falls by 0.1 mm."""

    span = (-np.inf, np.inf)

    def __init__(self, wavelength):
        self.wavelength = wavelength

    def recess(self, x):
        return 0.1 * (1 + np.cos(2 * np.pi * np.asarray(x) / self.wavelength))


class Slope:
    """A ramp from 0 to 10 mm without a period."""

    wavelength, span = None, (0.0, 10.0)

    def recess(self, x):
        return 0.3 * np.asarray(x)


EVEN = np.full((2, 2), 0.4)


@pytest.mark.parametrize("reach", [(-20.0, 20.0), (-0.5, 0.5)])
def test_a_hat_takes_its_share_of_a_sine_whether_it_is_tabulated_over_a_period_or_a_reach(reach):
    felt = FeltProfile.of(Sine(1.8), EVEN, reach)
    assert felt.period == (1.8 if reach[1] > 1 else 0.0)
    x = np.linspace(-0.45, 0.45, 50)
    u = np.pi * 0.4 / 1.8
    expected = 0.1 + 0.1 * (np.sin(u) / u) ** 2 * np.cos(2 * np.pi * x / 1.8)
    for shift in (0.0, 1.8, -3.6) if felt.period else (0.0,):
        # Straight lines between knots are off by the square of their distance times the curvature over 8: 3.3e-5 mm
        both = np.array([felt.recess(np.array([one, one]) + shift) for one in x])
        assert both == pytest.approx(np.column_stack([expected, expected]), abs=4e-5)


def test_the_mean_of_an_uneven_hat_lies_off_its_node():
    hats = np.array([[0.2, 0.5], [0.5, 0.2], [0.3, 0.3], [0.0, 0.4], [0.4, 0.0], [0.2, 0.5]])
    felt = FeltProfile.of(Slope(), hats, (-5.0, 15.0))
    assert len(felt.values) == 5, "one table for each kind of hat"
    # The centroid of a hat lies (right - left) / 3 beside its node
    at = np.full(len(hats), 4.0)
    assert felt.recess(at) == pytest.approx(0.3 * (4.0 + (hats[:, 1] - hats[:, 0]) / 3), abs=1e-4)
    assert felt.step <= 0.2 / 25, "25 knots in the narrowest side"


def test_a_period_must_be_two_elements_long_and_a_table_must_not_be_endless():
    assert FeltProfile.of(Sine(0.801), EVEN, (-5.0, 5.0)).period == 0.801
    with pytest.raises(InputError, match=r"wavelength 0.8 mm is not resolved by the skin's elements of 0.4 mm"):
        FeltProfile.of(Sine(0.8), EVEN, (-5.0, 5.0))
    with pytest.raises(InputError, match="too long for elements of 0.4 mm: slide less far"):
        FeltProfile.of(Sine(1e6), EVEN, (0.0, 17_000.0))
    assert FeltProfile.of(Grating(0.9, 0.9, 0.3), EVEN, (-5.0, 5.0)).period == pytest.approx(1.8)
