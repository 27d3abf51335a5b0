"""What to press next: against every other choice, and against what a fit then knows."""

from itertools import combinations_with_replacement

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.fem.pressing.response import response
from papilla.fem.reduction.family import family
from papilla.identification import identify
from papilla.identification import suggest as module
from papilla.identification.suggest import suggest_presses
from papilla.logs import PressLog
from papilla.model.finger import Finger
from papilla.model.specimen import Block

SIZE_MM = 2.8
MODULI, FORCES = (0.089, 0.72), (0.1, 0.4, 0.9)


@pytest.fixture(scope="module")
def told():
    """What presses of the default geometry measure."""
    return response(family(Finger.default(), size_mm=SIZE_MM), Block(1.0, 10.0))


@pytest.fixture(scope="module")
def identified(told):
    """A finger identified from six presses."""
    force, modulus = np.array([0.1, 0.2, 0.3, 0.5, 0.7, 0.9]), np.array([0.089, 0.51] * 3)
    felt = told.felt(force, modulus, 0.15, 0.03).values
    reading = 1e6 * (0.3 * felt[:, 0] - 0.2 * felt[:, 1]) + 10
    noise = np.random.default_rng(3).normal(0, 5, reading.shape)
    log = PressLog(force, modulus, reading + noise, ("g1", "g2", "g3", "g4", "g5"))
    return identify(log, Finger.default(), size_mm=SIZE_MM)


@pytest.mark.slow
@pytest.mark.parametrize("criterion", ["I", "D"])
def test_no_other_pair_of_presses_tells_more(identified, criterion):
    found = suggest_presses(identified, 2, MODULI, forces=FORCES, criterion=criterion)
    force, modulus = (axis.ravel() for axis in np.meshgrid(FORCES, MODULI, indexing="ij"))
    made = identified.problem.jacobian(identified.vector)
    candidates = (force, modulus, np.zeros((len(force), 2)))
    finger = module._finger(identified.problem, identified.vector, candidates, made.T @ made)

    def score(rows):
        information = finger.known + finger.each[list(rows)].sum(axis=0)
        return -np.linalg.slogdet(information)[1] if criterion == "D" else finger.log_variance(information)

    pairs = list(combinations_with_replacement(range(len(force)), 2))
    best = min(pairs, key=score)
    rows = [
        int(np.flatnonzero((force == f) & (modulus == e))[0])
        for f, e in zip(found.force_N, found.modulus_MPa, strict=True)
    ]
    assert score(rows) == pytest.approx(score(best), abs=1e-6)
    assert found.criterion == criterion and found.sigma_after < found.sigma_before


@pytest.mark.slow
def test_what_is_known_before_is_what_the_fit_knows(identified):
    """The information of an identification is the inverse of its covariance, where its sigmas were not widened."""
    one, more = (suggest_presses(identified, count, MODULI, forces=FORCES) for count in (1, 4))
    assert one.sigma_before == more.sigma_before
    assert more.sigma_after < one.sigma_after < one.sigma_before
    made = identified.problem.jacobian(identified.vector)
    one_press = (np.array([0.3]), np.array([0.3]), np.zeros((1, 2)))
    finger = module._finger(identified.problem, identified.vector, one_press, made.T @ made)
    inverse = np.linalg.inv(finger.known)
    if identified.chi_square < 1.5 * identified.freedom:
        assert np.diag(inverse) == pytest.approx(np.diag(identified.covariance), rel=1e-6)
    variance = np.einsum("mf,fg,mg->m", finger.slope, inverse, finger.slope).mean()
    assert one.sigma_before == pytest.approx(np.sqrt(variance))


@pytest.mark.slow
def test_a_protocol_from_nothing_beats_evenly_spaced_presses_of_the_same_fingers(told):
    design = Finger.default()
    found = suggest_presses(design, 5, (0.089, 0.51, 0.72), size_mm=SIZE_MM)
    assert len(found.force_N) == 5 and set(found.modulus_MPa) > {0.72}
    force, modulus = np.linspace(0.05, 0.98, 5), np.resize([0.089, 0.51, 0.72], 5)
    spaced = (force, modulus, np.zeros((5, 2)))
    problem, vectors = module._from_nothing(design, spaced, None, module.Noise(), 0, SIZE_MM)
    fingers = [module._finger(problem, vector, spaced, None) for vector in vectors]
    even = np.mean([one.log_variance(one.known + one.each.sum(axis=0)) for one in fingers])
    assert found.sigma_after < 0.95 * np.exp(even / 2)
    assert found == suggest_presses(design, 5, (0.72, 0.51, 0.089, 0.089), size_mm=SIZE_MM)


@pytest.mark.parametrize(
    "count, moduli, options, message",
    [
        (0, MODULI, {}, "number of presses to suggest must be at least 1, got 0"),
        (True, MODULI, {}, "at least 1, got True"),
        (2, (), {}, "at least one force and one modulus"),
        (2, (0.1, -1.0), {}, r"modulus \(MPa\) to press must be greater than 0"),
        (2, MODULI, {"forces": (0.0,)}, r"force \(N\) to press must be greater than 0"),
        (2, MODULI, {"criterion": "A"}, "criterion must be I or D, got 'A'"),
    ],
)
def test_what_cannot_be_suggested_is_refused(count, moduli, options, message):
    with pytest.raises(InputError, match=message):
        suggest_presses(Finger.default(), count, moduli, **options)
