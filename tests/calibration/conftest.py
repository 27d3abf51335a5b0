"""The made-up finger, its sweep and its calibration."""

from made_up_finger_fixtures import calibration as calibration
from made_up_finger_fixtures import made_up as made_up
from made_up_finger_fixtures import truth as truth
