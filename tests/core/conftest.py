"""Tests of pipes and processes wait for others: none of them waits without end."""

import signal

import pytest

MOST_WAIT_S = 40.0


@pytest.fixture(autouse=True)
def an_end_to_waiting():
    """A test that waits longer than `MOST_WAIT_S` fails, and again if it waits on while it is cleared away."""
    if not hasattr(signal, "setitimer"):
        yield
        return

    def fail(number, frame):
        raise TimeoutError(f"waited for {MOST_WAIT_S} s")

    before = signal.signal(signal.SIGALRM, fail)
    signal.setitimer(signal.ITIMER_REAL, MOST_WAIT_S, MOST_WAIT_S / 8)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
