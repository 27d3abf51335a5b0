"""A coarse section of the default finger, condensed once."""

import pytest

from papilla import Finger
from papilla.fem import prepare_section
from papilla.model.parts import Identified

COARSE_MM = 0.3


@pytest.fixture(scope="session")
def finger():
    return Finger.default()


@pytest.fixture(scope="session")
def coarse(finger):
    return prepare_section(finger, size_mm=COARSE_MM)


def _relaxing(shares, times_s, gauges=5):
    nothing = {name: () for name in ("parameters", "logarithmic", "values", "lower", "upper", "covariance")}
    return Identified(
        status="ok", presses=0, specimen="", friction=0.0, zeros_microstrain=(0.0,) * gauges, touch_down_mm=0.0,
        chi_square=0.0, freedom=0.0, force_error=0.0, noise_microstrain=0.0,
        relaxation_shares=shares, relaxation_times_s=times_s, **nothing,
    )  # fmt: skip


@pytest.fixture(scope="session")
def relaxing():
    """Function: what an identification tells of a finger whose relaxation alone is known."""
    return _relaxing
