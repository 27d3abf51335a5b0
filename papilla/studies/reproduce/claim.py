"""A claim of a paper, the experiment that answers it, and the verdict, which is the tolerance's alone."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from importlib.util import find_spec
from typing import Any, NamedTuple

Interval = tuple[float, float]


class Verdict(StrEnum):
    """What became of a claim."""

    REPRODUCED = "reproduced"
    NOT_REPRODUCED = "not reproduced"
    NOT_TESTABLE = "not testable here"


def near(value: float, *, percent: float = 0.0, by: float = 0.0) -> Interval:
    """Values within a share of `value`, in percent, and `by` its unit; a little more for rounding."""
    half = abs(value) * percent / 100 + by + 1e-9 * (1 + abs(value))
    return value - half, value + half


def above(value: float) -> Interval:
    """Values of at least `value`."""
    return value, math.inf


def below(value: float) -> Interval:
    """Values of at most `value`."""
    return -math.inf, value


TRUE: Interval = (1.0, 1.0)
"""What is to be 1: a share of agreements, or a thing that is so."""


@dataclass(frozen=True)
class Claim:
    """One claim.

    Parameters
    ----------
    key : short and unique, such as "A14": its paper (A 2006, B 2007, C Okamoto 2011, D Oddo 2011, E textiles, F what
        papilla is for) and its place there; X marks what is wrong or inconsistent in print.
    source : paper and section, equation or figure. claim : in our words.
    published : the figure, an interval, or what is said where there is no figure.
    accepted : the interval of measured values that reproduce it.
    unit : of published, accepted and measured. value : name of the finding of the experiment that is measured.
    call : the command or call that gives it.
    note : what to know beside it; {names} of findings are filled in.
    needs : a module of papilla that it waits for; cannot : why it cannot be tested here at all.
    """

    key: str
    source: str
    claim: str
    published: float | Interval | str
    accepted: Interval = TRUE
    unit: str = ""
    value: str = ""
    call: str = ""
    note: str = ""
    needs: str = ""
    cannot: str = ""

    @property
    def obstacle(self) -> str:
        """Why it cannot be tested now; empty where it can."""
        if self.cannot:
            return self.cannot
        return f"waits for {self.needs}" if self.needs and not exists(self.needs) else ""


def exists(module: str) -> bool:
    """Whether a module is there, without importing more than its parents."""
    try:
        return find_spec(module) is not None
    except ModuleNotFoundError:
        return False


class Series(NamedTuple):
    """A curve of a picture: x and y of one length; style "line", "points" or "bars" (then x are names)."""

    label: str
    x: Any
    y: Any
    style: str = "line"


@dataclass(frozen=True)
class Found:
    """What an experiment found: `values` by name, and its picture as `series` over the axes' labels.

    A value that is to be measured may be a sentence: why it could not be.

    title : what the picture shows, in a sentence. log : which axes are logarithmic, of "x", "y" and "xy".
    """

    values: Mapping[str, Any]
    title: str = ""
    x_label: str = ""
    y_label: str = ""
    series: tuple[Series, ...] = ()
    log: str = ""


@dataclass(frozen=True)
class Experiment:
    """A computation that answers several claims; `run` takes a function that is told what is done now.

    words : what is done, for a reader who knows the papers. simulated : what stands for hardware or people, by name.
    """

    name: str
    words: str
    claims: tuple[Claim, ...]
    run: Callable[[Callable[[str], None]], Found] = field(repr=False)
    simulated: str = ""


@dataclass(frozen=True)
class Answer:
    """A claim with what was measured; None where it could not be."""

    claim: Claim
    experiment: str
    measured: float | None
    verdict: Verdict
    note: str

    @classmethod
    def untested(cls, claim: Claim, experiment: str, why: str) -> "Answer":
        """The answer to a claim that could not be tested, and why."""
        note = f"{why}; {claim.note}" if claim.note and "{" not in claim.note else why
        return cls(claim, experiment, None, Verdict.NOT_TESTABLE, note)

    @classmethod
    def of(cls, claim: Claim, experiment: str, values: Mapping[str, Any]) -> "Answer":
        """The answer from the findings of its experiment: within the accepted interval, or not."""
        found = values[claim.value]
        if isinstance(found, str):
            return cls.untested(claim, experiment, found)
        measured = float(found)
        low, high = claim.accepted
        verdict = Verdict.REPRODUCED if low <= measured <= high else Verdict.NOT_REPRODUCED
        return cls(claim, experiment, measured, verdict, claim.note.format(**values))

    def to_json(self) -> dict[str, Any]:
        """The documented keys and what else is known, as plain values; an end that is open is None."""
        one = self.claim
        return {
            "key": one.key,
            "source": one.source,
            "claim": one.claim,
            "published": _plain(one.published),
            "measured": self.measured,
            "unit": one.unit,
            "verdict": str(self.verdict),
            "note": self.note,
            "accepted": _plain(one.accepted),
            "call": one.call,
            "experiment": self.experiment,
        }


def _plain(value: float | Interval | str) -> Any:
    if isinstance(value, tuple):
        return [end if math.isfinite(end) else None for end in value]
    return value
