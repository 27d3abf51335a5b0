"""Tests published claims: each experiment runs once for all the claims that it answers."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from papilla.core.errors import InputError, PapillaError
from papilla.core.progress import Progress, silent
from papilla.verify.case import Verdict
from papilla.verify.jobs import run_jobs
from papilla_papers.claims.claim import EVIDENCE_KINDS, VERDICT_WORDS, Answer, Claim, Experiment, read_claims
from papilla_papers.claims.experiments import ALL_EXPERIMENTS

ALL_CLAIMS: tuple[Claim, ...] = read_claims()
"""Every claim, paper by paper."""


@dataclass(frozen=True)
class Result:
    """An experiment, and the answers to its requested claims."""

    experiment: Experiment
    answers: tuple[Answer, ...]


def reproduce(only: str = "", **how) -> list[Answer]:
    """The answers of `results`, one after the other."""
    return [answer for result in results(only, **how) for answer in result.answers]


def results(
    only: str = "",
    *,
    processes: int = 1,
    progress: Progress = silent,
    experiments: Sequence[Experiment] = ALL_EXPERIMENTS,
    claims: Sequence[Claim] = ALL_CLAIMS,
) -> list[Result]:
    """Answer all claims, or those whose key, experiment, source or words contain the text `only`, by experiment.

    `processes` experiments run at once; `progress` is called with what is done now, how many experiments are done, and
    how many there are. Raises `InputError` if no claim contains the text.
    """
    chosen = _chosen(only.strip().lower(), experiments, claims)
    jobs = {
        experiment.name: (experiment, answered)
        for experiment in experiments
        if (answered := [c for c in chosen if c.experiment == experiment.name])
    }
    if not jobs:
        names = ", ".join(experiment.name for experiment in experiments)
        raise InputError(f"no claim holds {only!r}: give a key such as A14, words of a claim, or one of {names}")
    return [result for _, result in run_jobs(_run, jobs, processes=processes, progress=progress)]


def summary(answers: Sequence[Answer]) -> dict[str, int]:
    """How many answers have each verdict."""
    counted = Counter(answer.verdict for answer in answers)
    return {verdict: counted[verdict] for verdict in VERDICT_WORDS.values()}


def by_evidence(answers: Sequence[Answer]) -> dict[str, int]:
    """How many claims are reproduced with each kind of evidence."""
    counted = Counter(answer.claim.evidence for answer in answers if answer.verdict == VERDICT_WORDS[Verdict.WITHIN])
    return {evidence: counted[evidence] for evidence in EVIDENCE_KINDS[:-1]}


def head(answers: Sequence[Answer]) -> str:
    """The counts in a sentence."""
    counts, evidence = summary(answers), by_evidence(answers)
    prints = sum(answer.claim.contradiction for answer in answers)
    reproduced = ", ".join(f"{count} {name}" for name, count in evidence.items())
    rest = [VERDICT_WORDS[verdict] for verdict in (Verdict.OUTSIDE, Verdict.UNTESTED)]
    others = ", ".join(f"{counts[words]} {words}" for words in rest)
    return (
        f"{len(answers)} claims: {counts[VERDICT_WORDS[Verdict.WITHIN]]} reproduced ({reproduced}), {others}; "
        f"in {prints} of all rows the print contradicts itself or a closed form"
    )


def _chosen(text: str, experiments: Sequence[Experiment], claims: Sequence[Claim]) -> list[Claim]:
    """Claims of the experiment, with the key, or with the words that the text is."""
    if any(text == experiment.name for experiment in experiments):
        return [claim for claim in claims if claim.experiment == text]
    by_key = [claim for claim in claims if claim.key.lower() == text]
    texts = [" ".join((c.experiment, c.paper, c.source, c.claim, c.evidence)).lower() for c in claims]
    return by_key or [claim for claim, words in zip(claims, texts, strict=True) if text in words]


def _run(experiment: Experiment, claims: Sequence[Claim], progress: Progress) -> Result:
    """Run an experiment if any of its claims can be tested; an error of papilla becomes the reason for a missing
    answer."""
    if all(claim.cannot for claim in claims):
        return Result(experiment, tuple(Answer.of(claim, experiment, {}) for claim in claims))
    try:
        findings = experiment.run(lambda line: progress(f"{experiment.name}: {line}"))
    except PapillaError as error:
        why = f"the experiment ended in an error: {' '.join(str(error).split())}"
        return Result(experiment, tuple(Answer.untested(claim, experiment.name, why) for claim in claims))
    answers = []
    for claim in claims:
        answer = Answer.of(claim, experiment, findings)
        if claim.vary and answer.case.verdict == Verdict.OUTSIDE:
            progress(f"{experiment.name}: {claim.key} with other values of what is not printed")
        answers.append(answer.with_sensitivity(experiment))
    return Result(experiment, tuple(answers))
