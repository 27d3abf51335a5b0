"""Process between papilla and a job in a folder: `python watchdog.py FOLDER COMMAND...`.

papilla holds the other end of standard input and writes nothing. When that end closes, for whatever reason papilla
ended, the job is killed and its folder removed. The job itself cannot watch, because it may hold the interpreter's lock
for minutes.
"""

import os
import shutil
import signal
import subprocess
import sys
import threading

PR_SET_PDEATHSIG = 1  # Constant of Linux' prctl(2): the signal that a process gets when its parent has died


def keep(folder: str, command: list[str]) -> None:
    """Run `command` in `folder` and exit with its exit code; after a signal, with 128 plus its number."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            # A terminal sends these signals to the whole group; papilla alone decides.
            signal.signal(getattr(signal, name), lambda *_: None)
    job = subprocess.Popen(command, cwd=folder, stdin=subprocess.DEVNULL, preexec_fn=_die_with_parent())
    leaving = threading.Lock()

    def watch() -> None:
        while os.read(0, 1):
            pass
        with leaving:
            job.kill()
            job.wait()
            shutil.rmtree(folder, ignore_errors=True)
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
    code = job.wait()
    with leaving:
        os._exit(code if code >= 0 else 128 - code)


def _die_with_parent():
    """On Linux, a function that makes a new process end with its parent; None elsewhere."""
    if sys.platform != "linux":
        return None
    import ctypes

    prctl = ctypes.CDLL(None).prctl
    return lambda: prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


if __name__ == "__main__":
    keep(sys.argv[1], sys.argv[2:])
