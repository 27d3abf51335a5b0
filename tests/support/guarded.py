"""A bound of time and memory for each damaged input, and a watch over what is written."""

import signal
import tempfile
from contextlib import contextmanager
from pathlib import Path

SECONDS, MEMORY_BYTES = 30, 4 * 2**30
"""Time in which an input must be answered or refused, a hundred times the usual one, and memory that it may take."""


@contextmanager
def guarded(folder, monkeypatch):
    """Within the block nothing takes longer than `SECONDS` at once (call the yielded function before each input) or
    more memory than `MEMORY_BYTES`, and no file is left in `folder`, where relative names and temporary files lead. On
    Windows, which has neither limit, only files are watched."""
    place = folder / "temporary"
    place.mkdir()
    monkeypatch.setenv("TMPDIR", str(place))
    monkeypatch.chdir(folder)
    before = sorted(folder.rglob("*"))
    usual, tempfile.tempdir = tempfile.tempdir, None  # So that the variable counts
    try:
        with _limited() as again:
            yield again
    finally:
        tempfile.tempdir = usual
    assert sorted(folder.rglob("*")) == before, "files were left behind"


@contextmanager
def _limited():
    try:
        import resource
    except ImportError:
        yield lambda: None
        return

    def stop(*_):
        raise AssertionError(f"no answer within {SECONDS} s")

    usual = resource.getrlimit(resource.RLIMIT_AS)
    handler = signal.signal(signal.SIGALRM, stop)
    pages = Path("/proc/self/statm")
    if pages.exists():
        taken = int(pages.read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (taken + MEMORY_BYTES, usual[1]))
    try:
        yield lambda: signal.alarm(SECONDS)
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, handler)
        resource.setrlimit(resource.RLIMIT_AS, usual)
