"""The figures of a row in words, for the page and the terminal."""

import math

from papilla.studies.reproduce.claim import Answer


def number(value: float | None) -> str:
    """Four significant digits, without zeros behind; a dash where there is none."""
    return "–" if value is None or math.isnan(value) else f"{value:.4g}".replace("-", "−")


def published(answer: Answer) -> str:
    """What was published, a figure or an interval or words."""
    value = answer.claim.published
    if isinstance(value, str):
        return value
    if isinstance(value, tuple):
        return "–".join(number(end) for end in value)
    return number(value)


def accepted(answer: Answer) -> str:
    """The interval that reproduces a claim, in words."""
    low, high = answer.claim.accepted
    if low == -math.inf:
        return f"≤ {number(high)}"
    if high == math.inf:
        return f"≥ {number(low)}"
    return number(low) if high - low < 1e-6 * abs(high) else f"{number(low)} to {number(high)}"
