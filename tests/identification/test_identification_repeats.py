"""Noise of repeated presses: what was put in comes back, with the share that an error of force moves together."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from papilla.identification import Noise
from papilla.identification.noise import STATED_FREEDOM, estimated_noise
from papilla.logs import PressLog

SLOPE = np.array([800.0, -300.0, 1500.0, -250.0, 700.0, 0.4])


@dataclass
class Straight:
    """A problem whose model says the slope times ln force, for 5 gauges and the indentation."""

    log: PressLog
    noise: Noise
    reading_names: ClassVar[tuple[str, ...]] = ("g1", "g2", "g3", "g4", "g5")

    @property
    def measured(self):
        return np.column_stack([self.log.readings, self.log.indentation_mm])

    @property
    def reading_noise(self):
        return self.noise.readings_microstrain

    def modelled(self, vector):
        values = 1e3 + np.log(self.log.force_N)[:, None] * SLOPE
        return type("Told", (), {"values": values + vector, "by_ln_force": np.tile(SLOPE, (len(self.log), 1))})


def bench(seed, repeats, *, readings=12.0, force=0.03, depth=0.005, conditions=6):
    """Presses whose model is off by a constant of each condition, beside their noise."""
    rng = np.random.default_rng(seed)
    told = np.repeat(np.geomspace(0.1, 1.0, conditions), repeats)
    n = len(told)
    off = np.repeat(rng.normal(0, 50, (conditions, 6)), repeats, axis=0)
    true = np.log(told * (1 + force * rng.normal(size=n)))[:, None] * SLOPE + 1e3 + off
    measured = true + rng.normal(size=(n, 6)) * np.array([readings] * 5 + [depth])
    log = PressLog(told, np.full(n, 0.3), measured[:, :5], tuple(f"g{k}" for k in range(1, 6)), measured[:, 5])
    return Straight(log, Noise())


def test_many_repeats_tell_what_was_put_in():
    told = estimated_noise(bench(1, 40), np.zeros(6))
    assert told.repeats == 6 * 39
    assert told.readings_microstrain == pytest.approx(12.0, rel=0.15)
    assert told.force == pytest.approx(0.03, rel=0.25)
    assert told.indentation_mm == pytest.approx(0.005, rel=0.3)
    assert "estimated from 234 repeats" in told.words


def test_few_repeats_leave_much_of_what_was_stated():
    one = bench(2, 1)
    one.log = replace(one.log, force_N=np.append(one.log.force_N[:-1], one.log.force_N[0]))
    told = estimated_noise(one, np.zeros(6))
    assert told.repeats == 1 and told != one.noise
    stated = one.noise.force
    assert stated * np.sqrt(STATED_FREEDOM / (STATED_FREEDOM + 2)) < told.force


@pytest.mark.parametrize(
    "change", [{"modulus_MPa": np.arange(1.0, 7.0)}, {"x_mm": np.arange(6.0)}, {"on": np.arange(6)}]
)
def test_presses_of_other_conditions_are_no_repeats(change):
    one = bench(3, 1)
    equal = replace(one.log, force_N=np.full(6, 0.3))
    assert estimated_noise(Straight(equal, Noise()), np.zeros(6)).repeats == 5
    assert estimated_noise(Straight(replace(equal, **change), Noise()), np.zeros(6)) == Noise()
    sampled = replace(equal, t_s=np.arange(6.0))
    assert estimated_noise(Straight(sampled, Noise()), np.zeros(6)) == Noise()
