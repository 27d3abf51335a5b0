"""Runs code that may crash, hang or hold the interpreter's lock in a separate process: the mesher, and VTK's file
readers.

pytetwild cannot be interrupted and writes a file into the working directory; VTK's readers crash on damaged files. In a
child process with a temporary folder all this becomes one clear error.
"""

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from papilla.core.errors import FileAccessError, MeshError, PapillaError
from papilla.core.files import scratch
from papilla.core.outside import read_arrays, read_bytes, reason
from papilla.core.progress import Progress, silent
from papilla.core.workers import run_program
from papilla.mesh import worker

TIMEOUT_S = 1800.0  # A child that has not finished after this time hangs: the finest useful meshes take a few minutes
ERROR_LINES = 3

WORKER_SCRIPT = Path(worker.__file__)
"""A script, not a module: importing the package would take longer than most of its work."""

MESHER_VERSION = 1
"""Part of the key of every stored mesh, in place of the mesher's code and the versions of other packages. Raise it when
a change of `papilla.mesh` makes meshes that should replace those of users: other sizes or boundaries, better cells, a
fault removed. Users' fingers are then meshed again, and all results on a mesh are computed again."""


def tetrahedralise(
    soup: Mapping[str, np.ndarray], progress: Progress = silent, timeout_s: float = TIMEOUT_S
) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) in mm and tetrahedra (m, 4) that fill nested closed surfaces.

    `soup` has the arrays that `papilla.mesh.worker` reads; `progress` gets a line of text about twice a second. Raises
    what `run` and `cells_of` raise, and `MeshError` if the mesher returns nothing.
    """
    points, tets = cells_of(run("the mesher", "tetrahedralise", soup, progress, timeout_s), "the mesher", "tets", 4)
    if len(tets) == 0:
        raise MeshError("the mesher returned no tetrahedra")
    if not np.isfinite(points).all():
        raise MeshError("the mesher returned a point that is not finite")
    return points, tets


def cells_of(
    arrays: Mapping[str, np.ndarray], name: str, cells: str, corners: int, points: str = "points"
) -> tuple[np.ndarray, np.ndarray]:
    """Two arrays that a child made: `points` (n, 3), and whole numbers of points `cells` (m, corners).

    Raises `MeshError`, which calls the child `name`, for anything else. Nothing is said about the values of points.
    """
    positions, numbers = (np.asarray(arrays.get(key, np.empty(0, dtype=object))) for key in (points, cells))
    if positions.dtype.kind != "f" or positions.ndim != 2 or positions.shape[1] != 3:
        raise MeshError(f"{name} returned {points} of shape {positions.shape}, not numbers of shape (n, 3)")
    if numbers.dtype.kind not in "iu" or numbers.ndim != 2 or numbers.shape[1] != corners:
        raise MeshError(f"{name} returned {cells} of shape {numbers.shape}, not whole numbers of shape (m, {corners})")
    if numbers.size and not 0 <= int(numbers.min()) <= int(numbers.max()) < len(positions):
        raise MeshError(f"{name} returned {cells} with a corner that is not among its {len(positions)} {points}")
    return positions.astype(float), numbers.astype(np.int64)


def run(
    name: str, job: str, inputs: Mapping[str, np.ndarray], progress: Progress = silent, timeout_s: float = TIMEOUT_S
) -> dict[str, np.ndarray]:
    """The arrays that `job` of the worker computes from `inputs`; messages call it `name`.

    Raises `MeshError` if it crashes, hangs or returns nothing, `FileAccessError` if the temporary directory is not
    writable. The child does not outlive the call, whatever interrupts it. If papilla is killed, Linux kills the child,
    too; elsewhere it ends after its work. The folder is then removed by the next call.
    """
    with scratch("mesh") as folder:
        messages, target = folder / "messages.txt", folder / "output.npz"
        try:
            np.savez(folder / "input.npz", allow_pickle=False, **inputs)
            with messages.open("wb") as log:
                code = _code_of(folder, job, log, progress, timeout_s)
        except OSError as error:
            raise FileAccessError(f"cannot use the temporary directory for {name}: {reason(error)}") from error
        if code is None:
            raise MeshError(f"{name} did not finish within {timeout_s:g} s and was stopped")
        if code != 0 or not target.exists():
            cause = f"signal {-code}" if code < 0 else f"exit code {code}"
            lines = list(filter(None, map(str.strip, read_bytes(messages).decode(errors="replace").splitlines())))
            raise MeshError(f"{name} failed ({cause}): {' / '.join(lines[-ERROR_LINES:]) or 'it left no message'}")
        try:
            return read_arrays(target, f"what {name} returned")
        except PapillaError as error:
            raise MeshError(str(error)) from error


def _code_of(folder: Path, job: str, log, progress: Progress, timeout_s: float) -> int | None:
    """Exit code of the worker's job in the folder, None if it takes longer than the timeout."""
    # The child must find this copy of the package, installed or not.
    places = [str(Path(__file__).resolve().parents[2]), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(places)}
    # In a session of its own, because a terminal sends Ctrl-C to a whole session: papilla alone decides.
    return run_program(
        [sys.executable, "-P", str(WORKER_SCRIPT), job], timeout_s,
        None if progress is None else lambda seconds: progress(f"meshing, {seconds:.0f} s"),
        cwd=folder, env=environment, start_new_session=True, stdin=subprocess.DEVNULL, stdout=log,
        stderr=subprocess.STDOUT,
    )  # fmt: skip
