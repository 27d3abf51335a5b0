"""Logs of friction with known coefficients, and statistics of the estimator's answers.

The kinds of a scene are drawn at random: the motion (one direction, strokes, a hand), the force (constant, varying,
with lifts), the offset of the tangential sensor, the dependence of mu, the pull during a rest, and sensors with noise.
The skin shears before it slides (Dahl's model), so a start and a turn pull less than sliding does.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np

FALSE = 0.1
"""Relative error above which an answer that says "ok" is false."""
PEAK_S = 0.015
"""Length of a breakaway's peak, base to base."""
LAWS = ("constant", "by force", "by speed", "by wear", "ridges", "all of these")
PRESSES = ("constant", "varying", "lifted off")
MOVES = ("one way", "strokes", "hand")


@dataclass(frozen=True)
class Rubbed:
    """A log of friction: samples (n, 3) of T in N, N in N and velocity in mm/s.

    mu : (n,) true kinetic coefficient, NaN if it does not slide. offset : of the tangential sensor, N. static : (n,) of
    the last breakaway, NaN if there is none. told : whether offset_sigma_N, air, a rest or turns determine the offset.
    """

    rate_Hz: float
    samples: np.ndarray
    mu: np.ndarray
    offset: float
    static: np.ndarray
    told: bool = True
    options: dict[str, Any] = field(default_factory=dict)
    kinds: tuple[str, ...] = ()


class Judged(NamedTuple):
    """Statistics of the sliding rows: share answered, share ok; of the answered ones, share within two sigma; of the ok
    ones, share with an error above `FALSE`; medians of |error| / mu and of sigma / mu. Of the rows after a breakaway:
    share with a static coefficient, and share of these within two sigma. NaN without rows."""

    answered: float
    ok: float
    inside: float
    false: float
    error: float
    sigma: float
    static: float
    static_inside: float


def judge(scene: Rubbed, answer) -> Judged:
    """Compare the answers (a `FrictionEstimate` of arrays) to a scene."""
    from papilla.estimators.friction import FrictionStatus

    slides = np.isfinite(scene.mu)
    given = slides & np.isfinite(answer.mu_kinetic)
    good = np.array([status.good for status in FrictionStatus])[answer.status] & given
    off = np.abs(answer.mu_kinetic - scene.mu)
    peaks = slides & np.isfinite(scene.static)
    told = peaks & np.isfinite(answer.mu_static)
    static_off = np.abs(answer.mu_static - scene.static)

    def share(part: np.ndarray, whole: np.ndarray) -> float:
        return float((part & whole).sum() / whole.sum()) if whole.any() else float("nan")

    def median(values: np.ndarray) -> float:
        return float(np.median(values[given])) if given.any() else float("nan")

    return Judged(
        share(given, slides),
        share(good, slides),
        share(off <= 2 * answer.mu_kinetic_sigma, given),
        share(off > FALSE * scene.mu, good),
        median(off / scene.mu),
        median(answer.mu_kinetic_sigma / scene.mu),
        share(told, peaks),
        share(static_off <= 2 * answer.mu_static_sigma, told),
    )


def sheared(friction: np.ndarray, velocity: np.ndarray, rate: float, shear_mm: float, pull: float = 0.0) -> np.ndarray:
    """(n,) tangential force of a skin that shears by `shear_mm` before it slides with the friction (n,)."""
    steps, force = (velocity / rate / shear_mm).tolist(), []
    for limit, step in zip(friction.tolist(), steps, strict=True):
        # Dahl: dF/dx = (s limit - F) / shear, integrated exactly over a step; never beyond the present limit
        if step:
            end = limit if step > 0 else -limit
            pull = end + (pull - end) * np.exp(-abs(step))
        pull = min(max(pull, -limit), limit)
        force.append(pull)
    return np.array(force)


def _move(rng, kind: str, time: np.ndarray) -> np.ndarray:
    """(n,) velocity in mm/s."""
    top = np.exp(rng.uniform(np.log(5), np.log(200)))
    if kind == "one way":
        rest, slide = rng.uniform(0.3, 1.5), rng.uniform(1.5, 8.0)
        phase = (time + rng.uniform(0, rest)) % (rest + slide)
        return top * np.clip((phase - rest) / 0.03, 0, 1) * (1 + 0.2 * np.sin(rng.uniform(0.5, 3) * time))
    if kind == "strokes":
        rest, slide = rng.choice([0.0, rng.uniform(0.2, 1.5)]), rng.uniform(0.5, 4.0)
        turn, phase = np.divmod(time + rng.uniform(0, slide), rest + slide)
        way = np.where(turn % 2 < 1, 1.0, -1.0)
        if rng.random() < 0.4:
            return way * top * np.sin(np.pi * np.clip(phase / slide, 0, 1))
        return way * top * np.clip(np.minimum(phase, slide - phase) / 0.03, 0, 1)
    swing = np.sin(2 * np.pi * rng.uniform(0.3, 1.0) * time + rng.uniform(0, 6))
    swing += 0.4 * np.sin(2 * np.pi * rng.uniform(0.7, 2.0) * time + rng.uniform(0, 6))
    swing += rng.choice([0.0, 1.5])
    return top * np.sign(swing) * np.maximum(np.abs(swing) - 0.2, 0.0)


def _press(rng, kind: str, time: np.ndarray, hand: bool) -> np.ndarray:
    """(n,) normal force in N, 0 in the air."""
    mean = np.exp(rng.uniform(np.log(0.15), np.log(3)))
    force = np.full(len(time), mean) * (1 + rng.uniform(0, 0.01) * np.sin(rng.uniform(1, 20) * time))
    if kind != "constant" or hand:
        for _ in range(3):
            swing = rng.uniform(0.03, 0.2) * np.sin(2 * np.pi * rng.uniform(0.1, 2.0) * time + rng.uniform(0, 6))
            force *= 1 + swing
    if kind == "lifted off":
        period, air = rng.uniform(2, 6), rng.uniform(0.2, 0.8)
        phase = (time + rng.uniform(0, period)) % period
        force *= np.clip((np.minimum(phase, period - phase) - air / 2) / rng.uniform(0.02, 0.2), 0, 1)
    elif rng.random() < 0.4:
        force *= np.clip((time - rng.uniform(0.2, 0.6)) / 0.1, 0, 1)
    return force


def _law(rng, kind: str, time, force, velocity) -> np.ndarray:
    """(n,) kinetic coefficient."""
    mu = np.full(len(time), np.exp(rng.uniform(np.log(0.12), np.log(1.0))))
    every = kind == "all of these"
    if kind == "by force" or every:
        mu *= np.maximum(force / np.median(force[force > 0]), 0.05) ** -rng.uniform(0, 1 / 3)
    if kind == "by speed" or every:
        mu *= 1 + rng.uniform(-0.3, 0.6) * np.exp(-np.abs(velocity) / rng.uniform(5, 60))
    if kind == "by wear" or every:
        begin, length = rng.uniform(0, time[-1]), rng.choice([0.02, 1.0, time[-1]])
        mu *= 1 + rng.uniform(-0.35, 0.35) * np.clip((time - begin) / length, 0, 1)
    return mu


def _break_away(rng, rate: float, velocity, mu, pull, force, slides) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,) static coefficient of the last start; pull and sliding, with breakaways in half of the draws."""
    static, pull, slides = np.full(len(mu), np.nan), pull.copy(), slides.copy()
    if rng.random() < 0.5:
        return static, pull, slides
    more, half = rng.uniform(0.05, 0.6), max(round(0.5 * rate * rng.choice([PEAK_S, 4 * PEAK_S])), 1)
    for start in np.flatnonzero(slides[1:] & ~slides[:-1]) + 1:
        # A finger that touches while moving has no breakaway
        if (force[max(start - round(0.2 * rate), 0) : start] < 0.03).any():
            continue
        peak = slice(start, min(start + 2 * half, len(mu)))
        rows = np.arange(peak.start, peak.stop)
        pull[peak] += more * (1 - np.abs(rows - start - half) / half) * (mu * force * np.sign(velocity))[peak]
        slides[peak] = False
        top = min(start + half, len(mu) - 1)
        static[peak.stop :] = abs(pull[top]) / max(force[top], 1e-9)
    return static, pull, slides


def drawn(seed: int) -> Rubbed:
    """A scene with random kinds."""
    rng = np.random.default_rng(seed)
    kinds = tuple(str(rng.choice(each)) for each in (MOVES, PRESSES, LAWS))
    move, press, law = kinds
    rate = float(
        rng.choice([10.0, 50.0, 100.0, 200.0, 500.0, 1000.0]) if move != "hand" else rng.choice([200.0, 1000.0])
    )
    time = np.arange(round(rng.uniform(8, 20) * rate)) / rate
    velocity, force = _move(rng, move, time), _press(rng, press, time, move == "hand")
    mu = _law(rng, law, time, force, velocity)
    # The skin is rougher in one direction than in the other
    mu = mu * (1 + rng.normal(0, 0.03) * np.sign(velocity))
    pull = sheared(mu * force, velocity, rate, rng.uniform(0.05, 0.4))
    slides = (velocity != 0) & (np.abs(pull) > 0.95 * mu * force) & (force > 0.03)
    let_go = rng.random() < 0.7
    if let_go:
        pull = np.where(velocity == 0, rng.normal(0, 0.05) * mu * force, pull)
    if law in ("ridges", "all of these"):
        place = np.cumsum(velocity) / rate
        pull *= 1 + rng.uniform(0.02, 0.15) * np.sin(2 * np.pi * place / rng.uniform(0.5, 5.0))
    static, pull, slides = _break_away(rng, rate, velocity, mu, pull, force, slides)
    offset, told = rng.uniform(-0.3, 0.3), {}
    if rng.random() < 0.25:
        offset, told = rng.normal(0, 0.003), {"offset_sigma_N": 0.003}
    scale = float(np.median(force[force > 0]))
    noise = np.exp(rng.uniform(np.log(1e-3), np.log(0.02))) * scale, rng.uniform(5e-4, 0.005) * scale
    tangential, normal = (
        own + rng.normal(0, size, len(time)) for own, size in zip((pull + offset, force), noise, strict=True)
    )
    seen = velocity + rng.normal(0, rng.uniform(0, 0.02) * np.abs(velocity).max(), len(time))
    if rng.random() < 0.15:
        seen = np.sign(velocity)
    both = (velocity[slides] > 0).any() and (velocity[slides] < 0).any()
    air = (force < 1e-6).sum() > 0.15 * rate
    rest = let_go and ((velocity == 0) & (force > 0.03)).sum() > 0.3 * rate
    return Rubbed(
        rate, np.column_stack([tangential, normal, seen]), np.where(slides, mu, np.nan), offset, static,
        told=bool(both or air or rest or told), options=told, kinds=kinds,
    )  # fmt: skip


_NOTHING = np.array(np.nan)


def tribometer(seed: int, told: bool = False) -> Rubbed:
    """(a) One direction for 180 s at 10 Hz in four steps of speed; mu changes by 4 % during running-in, and varies
    randomly with N.

    told : the offset is subtracted up to 1 mN.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(1800) / 10
    speed = np.repeat(np.sort(rng.uniform(30, 750, 4)), 450)
    normal = 3.0 + 0.01 * np.sin(2 * np.pi * rng.uniform(0.05, 1) * time) + rng.normal(0, 0.003, len(time))
    mu = rng.uniform(0.12, 0.4) * (1 + 0.06 * np.log(speed / speed[0])) * (1 + 0.04 * (1 - np.exp(-time / 60)))
    offset = rng.normal(0, 0.1)
    # T is correlated with N: mu varies with it by chance, or with the place on the disc
    tangential = mu * 3.0 + rng.uniform(-0.8, 0.2) * (normal - 3.0) + offset + rng.normal(0, 0.004, len(time))
    mu[:8] = np.nan
    if told:
        samples = np.column_stack([tangential - offset, normal, speed])
        return Rubbed(10.0, samples, mu, 0.0, _NOTHING, True, {"offset_sigma_N": 1e-3}, ("(a) told",))
    samples = np.column_stack([tangential, normal, speed])
    return Rubbed(10.0, samples, mu, offset, _NOTHING, told=False, kinds=("(a) tribometer",))


def long_strokes(seed: int, rests: bool = True) -> Rubbed:
    """(b) Strokes of 10 s at 50 Hz, 20 gf, and an offset nearly as large as the friction; with or without rests."""
    rng = np.random.default_rng(seed)
    time = np.arange(6000) / 50
    turn, phase = np.divmod(time, 12.0)
    way, moving = np.where(turn % 2 < 1, 1.0, -1.0), phase < 10
    normal = 0.2 * (1 + 0.1 * np.sin(2 * np.pi * rng.uniform(0.05, 0.5) * time + rng.uniform(0, 6)))
    mu, offset = rng.uniform(0.6, 1.0), rng.uniform(0.13, 0.16)
    fades = np.exp(-(phase - 10) / rng.uniform(0.05, 0.3)) * ~moving + moving * (1 - np.exp(-phase / 0.1))
    tangential = way * mu * normal * fades + offset + rng.normal(0, 0.002, len(time))
    samples = np.column_stack([tangential, normal, way * (moving if rests else 1.0)])
    true = np.where(moving & (phase > 0.3), mu, np.nan)
    return Rubbed(50.0, samples, true, offset, _NOTHING, kinds=("(b) rests told" if rests else "(b) rests not told",))


def swipe(seed: int, told: bool = False) -> Rubbed:
    """(c) A hand's swipe of 7 s at 1 kHz, one way; mu falls within a second; a breakaway of 15 ms."""
    rng = np.random.default_rng(seed)
    time = np.arange(7000) / 1000
    begin, falls = rng.uniform(0.8, 1.5), rng.uniform(3.0, 5.5)
    normal = np.exp(rng.uniform(np.log(0.3), np.log(2.0))) * (1 + 0.1 * np.sin(rng.uniform(2, 8) * time))
    velocity = rng.uniform(30, 120) * np.clip((time - begin) / 0.3, 0, 1) * (1 + 0.2 * np.sin(4 * time))
    first, static = rng.uniform(0.38, 0.48), rng.uniform(0.5, 0.6)
    mu = first + (0.27 - first) * np.clip((time - falls) / 1.0, 0, 1)
    # The pull grows for 0.4 s during the rest, and then falls linearly
    grown = np.clip((time - begin + 0.4) / 0.4, 0, 1)
    peak = np.clip(1 - np.abs(time - begin) / (0.5 * PEAK_S), 0, 1)
    pull = grown * mu + (static - first) * peak
    offset = rng.normal(0, 0.003 if told else 0.05)
    samples = np.column_stack([pull * normal + offset + rng.normal(0, 0.003, 7000), normal, velocity])
    samples[:, 1:] += rng.normal(0, 1, (7000, 2)) * (0.002, 0.5)
    true = np.where(time > begin + 0.02, mu, np.nan)
    options, kind = ({"offset_sigma_N": 0.003}, "(c) told") if told else ({}, "(c) swipe")
    return Rubbed(1000.0, samples, true, offset, np.array(static), True, options, (kind,))


def encoder(seed: int) -> Rubbed:
    """(d) To and fro; the velocity is the difference of an encoder's raw positions."""
    rng = np.random.default_rng(seed)
    rate = float(rng.choice([100.0, 500.0, 1000.0]))
    time = np.arange(round(20 * rate)) / rate
    frequency, reach, step = rng.uniform(0.2, 1.0), rng.uniform(5, 20), rng.choice([0.005, 0.02, 0.05])
    place = reach * np.sin(2 * np.pi * frequency * time)
    velocity = np.gradient(place, time)
    raw = np.gradient(np.round((place + rng.normal(0, 0.2 * step, len(time))) / step) * step, time)
    normal = rng.uniform(0.5, 5.0) * (1 + 0.02 * np.sin(9 * time))
    mu, offset = rng.uniform(0.08, 0.4), rng.uniform(-0.1, 0.1)
    pull = sheared(mu * normal, velocity, rate, 0.1)
    true = np.where(np.abs(pull) > 0.95 * mu * normal, mu, np.nan)
    samples = np.column_stack([pull + offset + rng.normal(0, 0.005, len(time)), normal, raw])
    return Rubbed(rate, samples, true, offset, _NOTHING, kinds=("(d) encoder",))


def by_force(seed: int) -> Rubbed:
    """Strokes with mu ~ N^(-1/3) and N +- 20 %; the true mu is that at the mean force."""
    rng = np.random.default_rng(seed)
    time = np.arange(12000) / 1000
    normal = rng.uniform(0.3, 2.0) * (1 + 0.2 * np.sin(2 * np.pi * rng.uniform(0.2, 1.0) * time + rng.uniform(0, 6)))
    velocity = 40 * np.where(time % 4 < 2, 1.0, -1.0) * (time % 2 > 0.3)
    mu = rng.uniform(0.2, 0.6)
    pull = sheared(mu * (normal / normal.mean()) ** (-1 / 3) * normal, velocity, 1000.0, 0.2)
    offset = rng.uniform(-0.1, 0.1)
    samples = np.column_stack([pull + offset + rng.normal(0, 0.003, len(time)), normal, velocity])
    true = np.where((velocity != 0) & (time % 2 > 0.4), mu, np.nan)
    return Rubbed(1000.0, samples, true, offset, _NOTHING, kinds=("mu ~ N^(-1/3)",))


NAMED: Mapping[str, Callable[[int], Rubbed]] = {
    "tribometer": tribometer,
    "told_tribometer": partial(tribometer, told=True),
    "long_strokes": long_strokes,
    "rests_not_told": partial(long_strokes, rests=False),
    "swipe": swipe,
    "told_swipe": partial(swipe, told=True),
    "encoder": encoder,
    "by_force": by_force,
}
"""The kinds of logs that an estimator of friction was found wrong on."""
