"""The experiments in the order of the table, and how they are run: once each, whatever number of claims it answers."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from papilla.errors import InputError, MissingExtraError, PapillaError
from papilla.studies.reproduce.claim import Answer, Claim, Experiment, Found, Verdict
from papilla.studies.reproduce.experiments import EXPERIMENTS

CLAIMS: tuple[Claim, ...] = tuple(claim for experiment in EXPERIMENTS for claim in experiment.claims)
"""Every claim, in the order of the table."""


@dataclass(frozen=True)
class Result:
    """An experiment, the answers to those of its claims that were asked for, and what it found (None: not run)."""

    experiment: Experiment
    answers: tuple[Answer, ...]
    found: Found | None


def reproduce(
    only: str = "",
    *,
    progress: Callable[[str, int, int], None] = lambda line, done, total: None,
    experiments: Sequence[Experiment] = EXPERIMENTS,
) -> list[Answer]:
    """Answer all claims, or those whose key, experiment, source or words hold the text `only`.

    `progress` is called with what is done now, how many experiments are done, and how many there are. Raises
    `InputError` for a text that no claim holds.
    """
    return [answer for result in results(only, progress=progress, experiments=experiments) for answer in result.answers]


def results(
    only: str = "",
    *,
    progress: Callable[[str, int, int], None] = lambda line, done, total: None,
    experiments: Sequence[Experiment] = EXPERIMENTS,
) -> list[Result]:
    """`reproduce`, experiment by experiment, with what each found."""
    chosen = [(one, claims) for one in experiments if (claims := _chosen(one, only))]
    if not chosen:
        names = ", ".join(one.name for one in experiments)
        raise InputError(f"no claim holds {only!r}: give a key such as A14, words of a claim, or one of {names}")
    found = []
    for done, (experiment, claims) in enumerate(chosen):

        def tell(line: str, name: str = experiment.name, done: int = done) -> None:
            progress(f"{name}: {line}" if line else name, done, len(chosen))

        tell("")
        found.append(_run(experiment, claims, tell))
    return found


def summary(answers: Sequence[Answer]) -> dict[str, int]:
    """How many answers have each verdict."""
    counted = Counter(answer.verdict for answer in answers)
    return {str(verdict): counted[verdict] for verdict in Verdict}


def _chosen(experiment: Experiment, only: str) -> tuple[Claim, ...]:
    text = only.strip().lower()
    if any(text == one.name for one in EXPERIMENTS):
        return experiment.claims if experiment.name == text else ()
    if text in (claim.key.lower() for claim in experiment.claims):
        return tuple(claim for claim in experiment.claims if claim.key.lower() == text)
    if any(text == claim.key.lower() for claim in CLAIMS):
        return ()
    return tuple(
        claim for claim in experiment.claims if text in " ".join((experiment.name, claim.source, claim.claim)).lower()
    )


def _run(experiment: Experiment, claims: tuple[Claim, ...], tell: Callable[[str], None]) -> Result:
    """Run an experiment if any of the claims can be tested; an error of papilla's own is why it could not."""
    name = experiment.name
    if all(claim.obstacle for claim in claims):
        return Result(experiment, tuple(Answer.untested(claim, name, claim.obstacle) for claim in claims), None)
    try:
        found = experiment.run(tell)
    except MissingExtraError as error:
        return Result(experiment, tuple(Answer.untested(claim, name, str(error)) for claim in claims), None)
    except PapillaError as error:
        message = f"the experiment ended in an error: {' '.join(str(error).split())}"
        return Result(experiment, tuple(Answer.untested(claim, name, message) for claim in claims), None)
    answers = tuple(
        Answer.untested(claim, name, claim.obstacle) if claim.obstacle else Answer.of(claim, name, found.values)
        for claim in claims
    )
    return Result(experiment, answers, found)
