"""A coarse section of the default finger, condensed once."""

from dataclasses import replace

import pytest

from papilla import Finger
from papilla.fem import prepare_section
from papilla.fem.sliding.section import SectionModel
from papilla.mesh.section import build_section

COARSE_MM = 0.3


@pytest.fixture(scope="session")
def finger():
    return Finger.default()


@pytest.fixture(scope="session")
def coarse(finger):
    return prepare_section(finger, size_mm=COARSE_MM)


@pytest.fixture(scope="session")
def smooth(finger):
    return prepare_section(replace(finger, ridges=None), size_mm=COARSE_MM)


@pytest.fixture(scope="session")
def model(finger):
    return SectionModel(finger, build_section(replace(finger, ridges=None), size_mm=COARSE_MM))
