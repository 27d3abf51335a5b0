"""A program that starts worker processes and is killed."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

PATIENCE_S = 20.0


def is_alive(process: int) -> bool:
    """Whether a process with this number runs; one that has ended and waits for its parent (Linux: Z) does not."""
    try:
        os.kill(process, 0)
        status = Path(f"/proc/{process}/stat")
        return not status.exists() or status.read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def worker_ends_with(program: Path) -> bool:
    """Whether a worker process ends soon after its program was killed. The program prints the worker's number, then it
    waits. A worker that stays is killed, too."""
    with subprocess.Popen([sys.executable, str(program)], stdout=subprocess.PIPE, text=True) as client:
        worker = int(client.stdout.readline())
        client.kill()
    end = time.monotonic() + PATIENCE_S
    while is_alive(worker):
        if time.monotonic() > end:
            os.kill(worker, signal.SIGKILL)
            return False
        time.sleep(0.05)
    return True
