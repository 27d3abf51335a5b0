"""How far a touch has crept, a sample at a time, and what the pipeline's status says of it."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.estimators import Doubts, Pipeline
from papilla.estimators.pipeline.outputs import CREEP_WORDS, Creep
from papilla.references import Prony

TERMS = {"shares": [0.2, 0.1], "times_s": [0.3, 4.0]}


def test_samples_one_by_one_creep_as_the_history_does():
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.uniform(0.01, 0.4, 60))
    force = np.abs(0.3 + 0.2 * rng.normal(size=60)) + 0.01
    ratio = Prony(tuple(TERMS["shares"]), tuple(TERMS["times_s"])).strained(time, force) / force
    low, high = np.quantile(ratio, [0.3, 0.6])
    creep = Creep({**TERMS, "crept": [low, high]}, 0.05)
    said = [creep.feel(*sample) for sample in zip(time.tolist(), force.tolist(), strict=True)]
    expected = np.where(ratio < low - 0.02, 1, np.where(ratio > high + 0.02, 2, 0))
    expected[force < 0.05] = 0
    assert said == expected.tolist()
    assert set(said) == {0, 1, 2}


@pytest.mark.parametrize(
    "broken", [{"shares": ["a"]}, {"crept": [1.0]}, {"crept": None}, {"shares": [0.2]}, {"times_s": [0.0, 1.0]}]
)
def test_a_broken_relaxation_is_refused(broken):
    with pytest.raises(InputError, match="finger.relaxation must have shares, times_s and crept|relaxation"):
        Creep({**TERMS, "crept": [1.0, 1.1], **broken}, 0.05)


def test_the_pipeline_says_where_a_touch_is_unlike_those_of_the_bench(calibration, touch):
    """Identified by touches of 0.5 s; here one of 0.05 s that is held."""
    silicone, rng = Prony((0.3,), (0.4,)), np.random.default_rng(1)
    ramp = np.linspace(0.1, 0.5, 10)
    slow = silicone.strained(ramp, 0.4 * ramp) / (0.4 * ramp)
    known = {"shares": [0.3], "times_s": [0.4], "crept": [float(slow[4:].min()), float(slow.max())]}
    force = np.concatenate([np.linspace(0.1, 0.4, 5), np.full(150, 0.4)])
    stream = np.column_stack([np.arange(155) / 100, touch(0.3, force, 2.0, 1e-3, rng)])
    of_bench = replace(calibration, finger={**calibration.finger, "relaxation": known})
    options = {"columns": ("force_N",), "gauge_sigma": 2.0, "sample_rate_Hz": 100.0, "doubts": Doubts.NONE}
    pipeline = Pipeline(of_bench, **options)
    answer = pipeline.process(stream)
    said = [1 if CREEP_WORDS[1] in one else 2 if CREEP_WORDS[2] in one else 0 for one in answer.status]
    assert said[5] == 1 and said[-1] == 2 and 0 in said and said == sorted(said, key=(1, 0, 2).index)
    assert f", but {CREEP_WORDS[2]}" in pipeline.sentences["modulus"]
    single, other = Pipeline(of_bench, **options), Pipeline(of_bench, **options)
    first = [single.update(row).status for row in stream[:60]]
    other.state = single.state
    assert [*first, *(other.update(row).status for row in stream[60:])] == answer.status
    plain = Pipeline(calibration, **options).process(stream)
    np.testing.assert_array_equal(plain.modulus_MPa, answer.modulus_MPa)
    assert all(np.isfinite(answer.modulus_MPa[np.array(said) > 0]))
