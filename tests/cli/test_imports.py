"""What a command imports: VTK weighs more than half of an installation and takes seconds to load."""

import subprocess
import sys

import numpy as np
import pytest

CODE = """
import sys
from papilla.cli.main import run
try:
    run({arguments!r})
except SystemExit as end:
    assert end.code == 0, end.code
print(sorted(name for name in sys.modules if name.partition(".")[0] in ("vtk", "vtkmodules", "pyvista")))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        ["press", "--modulus", "0.3", "--force", "0.5"],
        ["estimate", "log.csv", "--out", "estimates.csv"],
        ["identify", "--suggest", "1", "--moduli", "0.1,0.5"],
    ],
    ids=lambda arguments: " ".join(arguments[:2]),
)
def test_press_estimate_and_identify_import_no_vtk(tmp_path, arguments):
    time = np.arange(1000) / 1000
    log = np.column_stack([time, 40 * np.sin(2 * np.pi * 40 * time), 50 * time])
    np.savetxt(tmp_path / "log.csv", log, delimiter=",", header="t_s,g1,position_mm", comments="")
    done = subprocess.run(
        [sys.executable, "-c", CODE.format(arguments=arguments)], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "[]"
