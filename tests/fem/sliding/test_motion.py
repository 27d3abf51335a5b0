"""The motion of a sliding scene: even samples of what was given, and what is refused."""

import numpy as np
import pytest

from papilla.core.errors import FileFormatError, InputError
from papilla.fem import Motion


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
        ([0, 1, 2], [0, 1], None, "two points at least, got 3 times and 2 places"),
        ([0, 1, 2], [0, np.nan, 1], None, "point 2 of the motion is not finite"),
        ([0, np.inf, 2], [0, 1, 1], None, "point 2 of the motion is not finite"),
        ([0, 1, 1], [0, 1, 2], None, "point 3 does not"),
        ([0, 2, 1], [0, 1, 2], None, "point 3 does not"),
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


@pytest.mark.parametrize(
    "seconds, rate, message",
    [(2001.0, 1000.0, "2001 s at 1000 Hz are more than 2,000,000 samples"), (0.001, 1000.0, "fewer than two samples")],
)
def test_scenes_have_two_samples_to_two_million(seconds, rate, message):
    with pytest.raises(InputError, match=message):
        Motion.steady(1.0, seconds, rate)
    assert len(Motion.steady(1.0, 2000.0).t_s) == 2_000_000 and len(Motion.steady(1.0, 0.002).t_s) == 2


def test_a_file_is_read_and_its_faults_are_named(tmp_path):
    path = tmp_path / "motion.csv"
    path.write_text("note,t_s,position_mm\na,0,0\nb,0.5,3\nc,1,0\n")
    assert Motion.read(path, 10.0).position_mm == pytest.approx([0, 0.6, 1.2, 1.8, 2.4, 3, 2.4, 1.8, 1.2, 0.6])
    assert len(Motion.read(path, 10.0, 0.5).t_s) == 5
    path.write_text("t_s,place\n0,0\n1,1\n")
    with pytest.raises(
        FileFormatError, match=r"motion.csv, line 1: column position_mm is missing \(found t_s, place\)"
    ):
        Motion.read(path)
    path.write_text("t_s,position_mm\n0,0\n0,1\n")
    with pytest.raises(FileFormatError, match="motion.csv: times of a motion must rise"):
        Motion.read(path)
