"""Which channels contradict the others: samples that do not fit, the surfaces, and what is known of the modulus.

A channel is blamed when all others fit without it, and no rival explanation fits about as well: another channel, the
force, or two gauges that mirror each other (one amplifier, one batch of foil). Channels under any such suspicion are
left out together. The search tries a few explanations a sample, so that no update takes long: samples in between are
answered by MISFIT, and so are those after a search that found nobody, until it is time for another.

Gauges that mirror each other are alike for a press at the apex: exchanged, they read the same, which is neither seen
nor does harm.
"""

import math
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

from papilla.estimators.softness.faults import Fault
from papilla.estimators.softness.sample_fit import OwnFit, Rules, SampleFitter
from papilla.estimators.softness.surfaces import Section

LIMIT = 50.0
"""Squared misfit of a sample (at most 5 degrees of freedom) from which something is wrong: 1e-9 of good samples."""
AGREES = 30.0
"""Squared misfit below which the remaining channels agree."""
MARGIN = 15.0
"""Suspects whose absence leaves as good a fit as this, compared with the best, cannot be told apart."""
FITS = 25.0
"""Squared residual of a reading that is explained by a flipped sign or by another gauge's place."""
FITS_A_SAMPLE = 8
"""Explanations that one sample tries where the modulus is known; where it is not, it tries one."""
REST = 50
"""Samples that do not fit between one search that found nobody and the next."""


class Known(NamedTuple):
    """What is known of the modulus: ln E and its variance; nothing when the variance is infinite."""

    ln_modulus: float
    variance: float


class Suspicion(NamedTuple):
    """Channels without which a sample fitted: squared misfit that was left, who, and ln E of that fit."""

    left: float
    suspects: tuple[int, ...]
    ln_modulus: float


class Search(NamedTuple):
    """How far a search has come: explanations tried, those of the present stage that fit, the channels that it is
    about, and for how many samples it rests. due : the next sample goes on with it; where nothing is learnt yet,
    samples are tried with all channels and searched in turn."""

    tried: int = 0
    found: tuple[Suspicion, ...] = ()
    channels: tuple[int, ...] = ()
    rest: int = 0
    due: bool = False


class Verdict(NamedTuple):
    """New faults (per gauge and, last, the force), and whether the modulus has to be learnt anew."""

    faults: tuple[int, ...]
    anew: bool


class Explanation(NamedTuple):
    """Channels to leave out, the modulus being the known one or anything; explanations of a stage are rivals."""

    stage: int
    suspects: tuple[int, ...]
    known: bool


def misfit(own: OwnFit | None, known: Known) -> float:
    """Squared misfit of a sample: of its channels among each other, and of its modulus with the known one."""
    if own is None:
        return math.inf
    return own.chi2 + (own.ln_modulus - known.ln_modulus) ** 2 / (own.variance + known.variance)


def search_on(
    search: Search, fitter: SampleFitter, readings, used, force, precision: float, known: Known, section: Section | None
) -> tuple[Verdict | None, Search]:
    """Go on with a search by one more sample whose misfit is beyond `LIMIT`: a verdict where there is one, and where
    the search stands.

    The likeliest comes first: one channel or a mirrored pair, the modulus being what was learnt; another specimen; one
    channel or a mirrored pair that has spoilt what was learnt; two channels.
    """
    if search.rest:
        return None, Search(rest=search.rest - 1)
    gauges = len(used)
    channels = tuple(number for number in range(gauges + 1) if (used[number] if number < gauges else precision > 0))
    if channels != search.channels:
        search = Search(channels=channels)
    learnt = known.variance < math.inf
    if not (learnt or search.due):
        return None, search._replace(due=True)
    plan = _plan(channels, fitter.rules, learnt)
    tried, found, spent = search.tried, list(search.found), 0
    while tried < len(plan):
        explanation = plan[tried]
        spent += 1 if explanation.known else FITS_A_SAMPLE
        if spent > FITS_A_SAMPLE:
            return None, Search(tried, tuple(found), channels)
        tried += 1
        suspicion = _try(explanation, fitter, readings, used, force, precision, known, section)
        if suspicion.left < AGREES:
            found.append(suspicion)
        if found and (tried == len(plan) or plan[tried].stage != explanation.stage):
            anew = learnt and not explanation.known
            verdict = _blame(fitter, readings, used, force, precision, channels, found, anew)
            return verdict, Search(rest=REST if verdict is None else 0)
    return None, Search(rest=REST)


@lru_cache(maxsize=64)
def _plan(channels: tuple[int, ...], rules: Rules, learnt: bool) -> tuple[Explanation, ...]:
    """All explanations in the order in which they are tried."""
    pairs: list[tuple[int, ...]] = list(combinations(channels, 2))
    mirrored = [pair for pair in pairs if rules.alike[pair[0]] == rules.alike[pair[1]]]
    single = [*((number,) for number in channels), *mirrored]
    double = [pair for pair in pairs if pair not in mirrored]
    stages = [(single, False), (double, False)]
    if learnt:
        stages = [(single, True), ([()], False), (single, False), (double, True)]
    return tuple(
        Explanation(stage, suspects, known)
        for stage, (rivals, known) in enumerate(stages)
        for suspects in rivals
        if _can_contradict(channels, suspects, rules)
    )


def _can_contradict(channels, suspects, rules: Rules) -> bool:
    """Whether what is left of the channels without the suspects is more than what the unknowns can fit."""
    return len({rules.kinds[number] for number in channels if number not in suspects}) >= rules.least


def _without(suspects: tuple[int, ...], used, precision: float) -> tuple[tuple[bool, ...], float]:
    """Which gauges are used without the suspects, and the precision of the force then."""
    kept = tuple([use and number not in suspects for number, use in enumerate(used)])
    return kept, 0.0 if len(used) in suspects else precision


def _try(
    explanation: Explanation,
    fitter: SampleFitter,
    readings,
    used,
    force,
    precision,
    known: Known,
    section: Section | None,
) -> Suspicion:
    kept, exact = _without(explanation.suspects, used, precision)
    if explanation.known and section is not None:
        own, modulus = fitter.alone(readings, kept, force, exact, section), known
    else:
        section, own = fitter.start(readings, kept, force, exact)
        modulus = Known(section.ln_modulus, math.inf)
    # A fit beyond what is calibrated explains nothing.
    left = math.inf if own is None else misfit(own, modulus) + fitter.beyond(own)
    return Suspicion(left, explanation.suspects, section.ln_modulus)


def _blame(
    fitter, readings, used, force, precision: float, channels, found: list[Suspicion], anew: bool
) -> Verdict | None:
    """All suspects that cannot be told apart, if the channels that are left without them can contradict each other."""
    # A pair with a channel that explains as much on its own is no rival to it.
    rivals = [
        one
        for one in found
        if not any(set(other.suspects) < set(one.suspects) and other.left < one.left + MARGIN for other in found)
    ]
    best = min(rivals)
    alike = [one for one in rivals if one.left < best.left + MARGIN]
    blamed = sorted(set().union(*[one.suspects for one in alike]))
    if not _can_contradict(channels, blamed, fitter.rules):
        return None
    faults = [int(Fault.NONE)] * (len(readings) + 1)
    for number in blamed:
        faults[number] = int(Fault.OFF_SURFACE)
    if len(alike) == 1:
        kept, exact = _without(best.suspects, used, precision)
        section = fitter.surfaces.section(best.ln_modulus)
        own = fitter.alone(readings, kept, force, exact, section)
        if own is not None:
            _name(faults, blamed, readings, fitter.expected(own, section, own.variance))
    return Verdict(tuple(faults), anew)


def _name(faults: list[int], blamed: list[int], readings, expected: list[tuple[float, float]]) -> None:
    """Say more of a fault where it can be said: a flipped sign, or two gauges in each other's place."""
    gauges = [number for number in blamed if number < len(readings)]

    def fits(reading: float, number: int) -> bool:
        value, sigma = expected[number]
        return (reading - value) ** 2 < FITS * sigma * sigma

    for number in gauges:
        if fits(-readings[number], number):
            faults[number] = int(Fault.SIGN_FLIPPED)
    for one, other in combinations(gauges, 2):
        if fits(readings[one], other) and fits(readings[other], one):
            faults[one] = faults[other] = int(Fault.SWAPPED)
