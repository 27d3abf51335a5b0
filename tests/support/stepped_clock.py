"""A clock of which a test decides how fast it goes."""


class SteppedClock:
    """A clock in ns that goes on only when somebody sleeps or works, which both call `sleep`."""

    def __init__(self):
        self.now = 10**12

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        """Let so many seconds pass."""
        self.now += round(1e9 * seconds)
