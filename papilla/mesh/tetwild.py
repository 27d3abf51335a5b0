"""Runs the tetrahedral mesher pytetwild in a process of its own.

pytetwild holds the interpreter lock, cannot be interrupted and writes a file into the working directory: in a child
process in a temporary directory all three are harmless, and a crash or a hang becomes a `MeshError`.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from papilla.errors import FileAccessError, MeshError

TIMEOUT_S = 1800.0
"""A mesher that has not finished by then has hung: the finest useful meshes take a few minutes."""

HEARTBEAT_S = 0.5
ERROR_LINES = 3

WORKER = "papilla.mesh.worker"
"""Module that is run with the names of its input and output files."""

Progress = Callable[[str], None]


def tetrahedralise(
    soup: dict[str, np.ndarray], progress: Progress | None = None, timeout_s: float = TIMEOUT_S
) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) in mm and tetrahedra (m, 4) that fill a soup of nested closed surfaces.

    `soup` holds the arrays that `papilla.mesh.worker` reads; `progress` gets a line of text about twice a second.
    Raises `MeshError` where the mesher crashes, hangs or returns nothing, `FileAccessError` where the temporary
    directory is not writable. The child does not outlive the call, whatever interrupts it.
    """
    try:
        with tempfile.TemporaryDirectory(prefix="papilla-mesh-") as folder:
            return _run(Path(folder), soup, progress, timeout_s)
    except OSError as error:
        if isinstance(error, FileAccessError):
            raise
        raise FileAccessError(f"cannot use the temporary directory for meshing: {error.strerror}") from error


def _run(folder: Path, soup, progress, timeout_s) -> tuple[np.ndarray, np.ndarray]:
    source, target, messages = folder / "soup.npz", folder / "mesh.npz", folder / "messages.txt"
    np.savez(source, **soup)
    with messages.open("wb") as log:
        child = subprocess.Popen(
            [sys.executable, "-m", WORKER, str(source), str(target)],
            cwd=folder,
            env=_environment(),
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
        )
        try:
            code = _wait(child, progress, timeout_s)
        finally:
            if child.poll() is None:
                child.kill()
                child.wait()
    if code is None:
        raise MeshError(f"the mesher did not finish within {timeout_s:g} s and was stopped")
    if code != 0 or not target.exists():
        raise MeshError(f"the mesher failed ({_cause(code)}): {_last_lines(messages)}")
    with np.load(target, allow_pickle=False) as data:
        points, tets = data["points"], data["tets"]
    if len(tets) == 0:
        raise MeshError("the mesher returned no tetrahedra")
    return points, tets


def _wait(child: subprocess.Popen, progress, timeout_s) -> int | None:
    """Exit code of the child, or None where it takes longer than the timeout."""
    start = time.monotonic()
    while True:
        try:
            return child.wait(timeout=HEARTBEAT_S)
        except subprocess.TimeoutExpired:
            elapsed = time.monotonic() - start
        if progress is not None:
            progress(f"meshing, {elapsed:.0f} s")
        if elapsed > timeout_s:
            return None


def _environment() -> dict[str, str]:
    """The child must find this very package, installed or not."""
    package_root = str(Path(__file__).resolve().parents[2])
    inherited = os.environ.get("PYTHONPATH")
    return {**os.environ, "PYTHONPATH": os.pathsep.join([package_root, inherited] if inherited else [package_root])}


def _cause(code: int) -> str:
    return f"signal {-code}" if code < 0 else f"exit code {code}"


def _last_lines(messages: Path) -> str:
    lines = [line.strip() for line in messages.read_text(errors="replace").splitlines() if line.strip()]
    return " / ".join(lines[-ERROR_LINES:]) or "it left no message"
