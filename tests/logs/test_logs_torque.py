"""A log with a torque: with its lever arm it is a tangential force, and without one it is refused."""

import numpy as np
import pytest

from papilla.core.errors import FileFormatError, InputError
from papilla.logs import TimeLogFile, read_time_log

ROWS = "t_s,g1,force_N,velocity_mm_s,torque_Nmm\n0,1,0.5,10,8\n0.001,2,0.5,10,-8\n0.002,3,0.5,10,nan\n"


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(ROWS)
    return path


def test_a_torque_over_its_lever_is_the_tangential_force(log):
    found = read_time_log(log, lever_mm=40.0)
    assert found.tangential_N[:2] == pytest.approx([0.2, -0.2]) and np.isnan(found.tangential_N[2])
    assert found.report.nan_cells == 1
    with TimeLogFile(log, lever_mm=40.0) as file:
        assert file.optional == ("force_N", "velocity_mm_s", "tangential_N")
        assert np.concatenate(list(file.blocks()))[0, -1] == pytest.approx(0.2)


def test_a_log_of_a_torque_alone_needs_no_gauges(tmp_path):
    (tmp_path / "a.csv").write_text("t_s,force_N,torque_Nmm\n0,1,2\n0.001,1,2\n")
    assert read_time_log(tmp_path / "a.csv", lever_mm=10.0).tangential_N == pytest.approx([0.2, 0.2])


def test_what_does_not_fit_together_is_refused(log, tmp_path):
    with pytest.raises(FileFormatError, match="torque_Nmm needs its lever arm"):
        read_time_log(log)
    with pytest.raises(InputError, match="lever_mm must be greater than 0"):
        read_time_log(log, lever_mm=-1.0)
    (tmp_path / "plain.csv").write_text("t_s,g1\n0,1\n0.001,2\n")
    with pytest.raises(FileFormatError, match="there is no column torque_Nmm"):
        read_time_log(tmp_path / "plain.csv", lever_mm=40.0)
    (tmp_path / "both.csv").write_text("t_s,g1,tangential_N,torque_Nmm\n0,1,1,1\n0.001,2,1,1\n")
    with pytest.raises(FileFormatError, match="not both"):
        read_time_log(tmp_path / "both.csv", lever_mm=40.0)
