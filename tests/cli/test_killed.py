"""A cold `calibrate` and a cold `identify` that are killed: nothing half-written, and the next run is right."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from papilla.logs import read_presses

COMMAND = "import sys; from papilla.cli.main import run; run(sys.argv[1:])"
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGKILL)
"""Of the first, second and third run: each dies when the cache holds one entry more than it was left with."""


def started(arguments, folder: Path) -> subprocess.Popen:
    environment = os.environ | {"PAPILLA_CACHE": str(folder / "cache")}
    command = [sys.executable, "-c", COMMAND, *map(str, arguments)]
    return subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def written(folder: Path) -> set[Path]:
    return {path for path in folder.rglob("*") if path.is_file() and "cache" not in path.parts}


def killed_and_repeated(arguments, folder: Path) -> None:
    """Kill runs on one cold cache, each a little later than the one before; then let one end."""
    before = written(folder)
    for number in SIGNALS:
        entries = len(list((folder / "cache").rglob("*.entry")))
        process = started(arguments, folder)
        while process.poll() is None and len(list((folder / "cache").rglob("*.entry"))) == entries:
            time.sleep(0.005)
        process.send_signal(number)
        told = process.communicate(timeout=60)[1].decode()
        assert process.returncode == (143 if number == signal.SIGTERM else -number), told
        assert written(folder) == before, "nothing is half-written, and no temporary file stays"
    process = started(arguments, folder)
    told = process.communicate(timeout=900)[1].decode()
    assert process.returncode == 0, told
    assert "damaged" not in told and not list(folder.rglob("*.tmp"))


@pytest.mark.slow
def test_a_killed_calibrate(papilla, tmp_path):
    cold = tmp_path / "cold"
    cold.mkdir()
    options = ("--quick", "--friction", "0", "--size-mm", "1.4")
    killed_and_repeated(["calibrate", *options, "--out", "c"], cold)
    assert papilla("calibrate", *options, "--out", tmp_path / "warm").code == 0
    once, again = (read_presses(folder / "sweep.csv") for folder in (cold / "c", tmp_path / "warm"))
    # To rounding: an earlier test of this process may have left a longer path of contact, whose sums round otherwise
    np.testing.assert_allclose(once.readings, again.readings, rtol=1e-12)
    np.testing.assert_allclose(once.indentation_mm, again.indentation_mm, rtol=1e-12)
    np.testing.assert_array_equal([once.force_N, once.modulus_MPa], [again.force_N, again.modulus_MPa])
    assert {path.name for path in (cold / "c").iterdir()} == {"calibration.json", "sweep.csv", "report.html"}
