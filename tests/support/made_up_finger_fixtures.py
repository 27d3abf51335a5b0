"""The made-up finger, its sweep and its calibration."""

import numpy as np
import pytest
from made_up_sweep import make_sweep, true_readings, true_sd

from papilla.calibration import fit


@pytest.fixture(scope="session")
def made_up():
    """The sweep of the made-up finger on 30 moduli and 30 forces."""
    return make_sweep(np.geomspace(0.02, 5, 30), np.geomspace(0.05, 1, 30))


@pytest.fixture(scope="session")
def calibration(made_up):
    """Its calibration, without mesh scatter."""
    return fit(made_up)


@pytest.fixture(scope="session")
def truth():
    """The closed forms and the maker of sweeps, for tests that need others."""
    names = {"sd": true_sd, "readings": true_readings, "sweep": make_sweep}
    return type("Truth", (), {name: staticmethod(form) for name, form in names.items()})
