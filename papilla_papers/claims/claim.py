"""Claims of papers (data, `claims.toml`), the experiments that test them, and the answers."""

import inspect
import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from papilla.core import cache
from papilla.core.errors import PapillaError
from papilla.core.outside import shipped, toml
from papilla.core.units import PER_CENT
from papilla.verify.case import Case, Interval, Verdict
from papilla_papers.claims.scenes import scenes

EVIDENCE_KINDS = ("predicted", "simulated", "fitted", "implemented", "none")
"""Evidence for a verdict: predicted by the finger's physics, or by an estimator on its signals, without a fit to the
figure; a simulated scene that could have failed; a figure that was used in a fit; an implemented formula, constant,
option or file; none."""
TESTED_EVIDENCE = EVIDENCE_KINDS[:2]
"""Evidence that could have failed: without its cause such a row must lose its verdict."""

VERDICT_WORDS = {Verdict.WITHIN: "reproduced", Verdict.OUTSIDE: "not reproduced", Verdict.UNTESTED: "not testable here"}
"""Words for the verdicts on a published claim."""

END_ROUNDING = 1e-9
"""Tolerance of an interval's ends: share of the value, and share of one."""


@dataclass(frozen=True)
class Claim:
    """One claim; the fields are those of its table in `claims.toml`.

    Parameters
    ----------
    key : short and unique, such as "A14": its paper (A 2006, B 2007, C Okamoto 2011, D Oddo 2011, E textiles, F what
        papilla is for) and its place there; X marks what is wrong or inconsistent in print.
    paper : its.
    experiment : name of the experiment that tests it.
    source : paper and section, equation or figure.
    claim : in our words.
    published : the figure, an interval, or words if there is no figure.
    accepted : the interval of measured values that reproduce it. In the file: `percent` or `by` its unit around `near`
        (by default the published figure), or `least` and `most`; without any, exactly the published figure, or 1 (a
        share of agreements, or a true statement) if words are published.
    tolerance : the printed digits, spread or words from which the interval follows.
    evidence : one of `EVIDENCE_KINDS`.
    test : of what is implemented, as "file::function" below tests/.
    contradiction : whether the print contradicts itself, or a closed form.
    unit : of published, accepted and measured.
    finding : name of the experiment's value that is compared.
    call : the command or call that gives it.
    note : notes; {names} of findings are filled in, and {simulated} by the experiment's.
    cannot : reason why it cannot be tested here.
    vary : other plausible values of parameters that the paper does not print, by their names in the experiment's
        `assumed`; a row that is not reproduced is computed with each of them.
    fixed : reason why there are none.
    """

    key: str
    paper: str
    experiment: str
    source: str
    claim: str
    published: float | Interval | str
    accepted: Interval
    evidence: str
    tolerance: str = ""
    unit: str = ""
    finding: str = ""
    call: str = ""
    note: str = ""
    cannot: str = ""
    test: str = ""
    contradiction: bool = False
    vary: Mapping[str, Sequence[float]] = field(default_factory=dict)
    fixed: str = ""

    @classmethod
    def from_table(cls, key: str, paper: str, table: Mapping[str, Any]) -> "Claim":
        """The claim that a table of `claims.toml` describes; key : name of the table, paper : that of its paper."""
        published = table["published"]
        published = tuple(published) if isinstance(published, list) else published
        accepted = _accepted(published, **table.get("accepted", {}))
        return cls(key, paper, **{**table, "published": published, "accepted": accepted})


def read_claims() -> tuple[Claim, ...]:
    """Every claim, paper by paper."""
    papers = toml(shipped("papilla_papers.claims", "claims.toml"), "claims.toml").items()
    return tuple(Claim.from_table(key, paper, table) for paper, claims in papers for key, table in claims.items())


def _accepted(published, *, near=None, percent=0.0, by=0.0, least=-math.inf, most=math.inf) -> Interval:
    """The interval that the keys of `accepted` give."""
    if math.isfinite(least) or math.isfinite(most):
        return least, most
    if near is None:
        near = published if isinstance(published, float) else 1.0
    half = abs(near) * percent / PER_CENT + by + END_ROUNDING * (1 + abs(near))
    return near - half, near + half


ALONE_SUFFIX = "_alone"
"""Suffix of the name of a fitted finding, for the value that a fit without it gives."""
LOST_FINDING = "lost"
"""Name of the value that gives the reason for missing values."""


def gathered(*parts: Callable[[], Mapping[str, Any]]) -> dict[str, Any]:
    """Values of the parts of an experiment; an error of papilla's own in one takes only its own values along."""
    values: dict[str, Any] = {}
    for part in parts:
        try:
            values |= part()
        except PapillaError as error:
            values[LOST_FINDING] = f"this part of the experiment ended in an error: {' '.join(str(error).split())}"
    return values


@dataclass(frozen=True)
class Experiment:
    """A computation that answers several claims; `run` takes a function for lines of progress and returns values by
    name.

    A value to be compared may be a sentence instead, which says why it could not be measured.

    The docstring of `run` is its description: a heading, and how it is done, as a paper's section on methods. With
    `cause=False` it runs without the effect that the claims are about (`removed` names it): then no tested row holds.

    simulated : name of the model that replaces hardware or people. noise : in words; seeds : number of random draws.
    assumed : a frozen dataclass of parameters that the papers do not print. varied : for each finding, a function of
    them that gives the values.
    """

    name: str
    run: Callable[..., Mapping[str, Any]] = field(repr=False)
    simulated: str = ""
    removed: str = ""
    noise: str = "none"
    seeds: int = 1
    assumed: Any = None
    varied: Mapping[str, Callable[[Any], Mapping[str, Any]]] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, run: Callable[..., Mapping[str, Any]], assumed: Any = None, **varied: Callable) -> "Experiment":
        """The experiment of a module that is named after it, as is its table in `scenes.toml`; varied : by finding."""
        name = run.__module__.rpartition(".")[2]
        return cls(name, run, **scenes()[name].about, assumed=assumed, varied=varied)

    @property
    def words(self) -> str:
        """The heading of the experiment, in a line."""
        return inspect.cleandoc(self.run.__doc__ or self.name).split("\n")[0].rstrip(".")

    @property
    def taken(self) -> str:
        """The assumed values of parameters that the papers do not print, in words."""
        return ", ".join(named(*parameter) for parameter in vars(self.assumed).items()) if self.assumed else ""

    @property
    def methods(self) -> str:
        """The method of the experiment."""
        return " ".join(inspect.cleandoc(self.run.__doc__ or "").split("\n")[1:]).strip()


class Variant(NamedTuple):
    """A row with another value of a parameter that is not printed; measured : None if there is no value."""

    parameter: str
    value: float
    measured: float | None
    verdict: str

    def __str__(self) -> str:
        return f"{named(self.parameter, self.value)}: {number(self.measured)}" + (
            ", reproduced" if self.verdict == VERDICT_WORDS[Verdict.WITHIN] else ""
        )


def named(parameter: str, value: object) -> str:
    """A parameter with its value and unit, in words: "edge 0.5 mm"."""
    unit = next((ending for ending in UNIT_ENDINGS if parameter.endswith(ending)), "")
    number_text = value if isinstance(value, str) else f"{value:g}"
    return f"{parameter.removesuffix(unit).replace('_', ' ')} {number_text} {UNIT_ENDINGS.get(unit, '')}".strip()


UNIT_ENDINGS = {"_mm_s": "mm/s", "_mm": "mm", "_s": "s", "_dB": "dB", "_Hz": "Hz"}
"""Units of parameters, by the end of their names."""


@dataclass(frozen=True)
class Answer:
    """A claim with its case: the measured value, the accepted interval, a note and the verdict.

    sensitivity : for a row that is not reproduced: its variation with parameters that the paper does not print.
    left_out : for a fitted row: the value of a fit without this figure.
    """

    claim: Claim
    experiment: str
    case: Case
    sensitivity: tuple[Variant, ...] = ()
    left_out: float | None = None

    def __repr__(self) -> str:
        return f"Answer({self.claim.key}, {self.verdict}: {self.measured} {self.claim.unit}\n  {self.claim.claim})"

    @classmethod
    def untested(cls, claim: Claim, experiment: str, why: str) -> "Answer":
        """The answer to a claim that could not be tested, and why."""
        note = f"{why}; {claim.note}" if claim.note and "{" not in claim.note else why
        return cls(claim, experiment, Case(claim.claim, note, None, claim.accepted))

    @classmethod
    def of(cls, claim: Claim, experiment: Experiment, values: Mapping[str, Any]) -> "Answer":
        """The answer from the findings of its experiment."""
        finding = claim.cannot or values.get(claim.finding, values.get(LOST_FINDING, f"no {claim.finding} was found"))
        if isinstance(finding, str):
            return cls.untested(claim, experiment.name, finding)
        findings = defaultdict(lambda: math.nan, {"simulated": experiment.simulated, **values})
        note = claim.note.format_map(findings if LOST_FINDING in values else {**findings})
        left_out = values.get(f"{claim.finding}{ALONE_SUFFIX}") if claim.evidence == "fitted" else None
        return cls(claim, experiment.name, Case(claim.claim, note, float(finding), claim.accepted), left_out=left_out)

    def with_sensitivity(self, experiment: Experiment) -> "Answer":
        """The answer with its sensitivity to other plausible values, if it is not reproduced."""
        claim = self.claim
        if self.case.verdict != Verdict.OUTSIDE or claim.evidence not in TESTED_EVIDENCE:
            return self
        tried = [(name, value) for name, values in claim.vary.items() for value in values]
        return replace(self, sensitivity=tuple(_variant(claim, experiment, *change) for change in tried))

    @property
    def measured(self) -> float | None:
        """The measured value; None if it could not be tested."""
        return self.case.value

    @property
    def verdict(self) -> str:
        """One of `VERDICT_WORDS`."""
        return VERDICT_WORDS[self.case.verdict]

    @property
    def note(self) -> str:
        """Remarks on the row."""
        return self.case.cause

    def to_json(self) -> dict[str, Any]:
        """The documented keys and further values, as plain values; an open end is None."""
        document = {name: getattr(self.claim, name) for name in ("key", "source", "claim")}
        document |= {"published": _plain(self.claim.published), "measured": _plain(self.measured)}
        document |= {"unit": self.claim.unit, "verdict": self.verdict, "note": self.note}
        document["accepted"] = _plain(self.claim.accepted)
        document |= {name: getattr(self.claim, name) for name in ("paper", "evidence", "contradiction", "tolerance")}
        document |= {"call": self.claim.call, "test": self.claim.test, "experiment": self.experiment}
        variants = [{**variant._asdict(), "measured": _plain(variant.measured)} for variant in self.sensitivity]
        return document | {"sensitivity": variants, "fixed": self.claim.fixed, "left_out": _plain(self.left_out)}


def _variant(claim: Claim, experiment: Experiment, name: str, value: float) -> Variant:
    """A row with one parameter changed; its numbers are kept in the cache."""
    compute, assumed = experiment.varied[claim.finding], replace(experiment.assumed, **{name: value})

    def make() -> dict[str, np.ndarray]:
        findings = compute(assumed)
        return {key: np.asarray(item) for key, item in findings.items() if not isinstance(item, str)}

    key = cache.key(compute.__module__, compute.__name__, assumed, scenes())
    try:
        findings = cache.fetch("claim", key, make)
    except PapillaError:
        findings = {}
    measured = float(findings[claim.finding]) if claim.finding in findings else None
    return Variant(name, value, measured, VERDICT_WORDS[Case("", "", measured, claim.accepted).verdict])


def _plain(value: float | Interval | str | None) -> Any:
    if isinstance(value, tuple):
        return [_plain(end) for end in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def number(value: float | None) -> str:
    """Four significant digits without trailing zeros; a dash for no value."""
    return "–" if value is None or math.isnan(value) else f"{value:.4g}".replace("-", "−")


def published(answer: Answer) -> str:
    """What was published, a figure or an interval or words."""
    value = answer.claim.published
    if isinstance(value, str):
        return value
    return "–".join(map(number, value)) if isinstance(value, tuple) else number(value)


def beside(answer: Answer) -> str:
    """The note on a row, in a sentence: the value of a fit without this figure, or its variation with other values of
    parameters that are not printed; empty if there is none."""
    if answer.left_out is not None:
        return f"left out of the fit: {number(answer.left_out)} {answer.claim.unit}"
    if not answer.sensitivity:
        return answer.claim.fixed if answer.case.verdict == Verdict.OUTSIDE else ""
    none = not any(variant.verdict == VERDICT_WORDS[Verdict.WITHIN] for variant in answer.sensitivity)
    return "with other values: " + "; ".join(map(str, answer.sensitivity)) + ("; none reproduces it" if none else "")


def accepted(answer: Answer) -> str:
    """The interval that reproduces a claim, in words."""
    low, high = answer.claim.accepted
    if low == -math.inf:
        return f"≤ {number(high)}"
    if high == math.inf:
        return f"≥ {number(low)}"
    return number(low) if high - low < 1e-6 * abs(high) else f"{number(low)} to {number(high)}"
