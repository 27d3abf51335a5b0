"""Logs of friction with known coefficients, and statistics of the estimator's answers.

What is drawn, and from which values, stands in `friction_logs.toml`. The skin shears before it slides (Dahl's model),
so a start and a turn pull less than sliding does.
"""

from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from papilla.core import settings
from papilla.estimators.friction import FrictionStatus

FALSE = 0.1
"""Relative error above which an answer that says "ok" is false."""
TOUCHING_N, SLIDING = 0.03, 0.95
"""Force of a contact, and share of the friction from which the skin slides."""
RULES = settings.tables(__package__, "friction_logs")


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
    slides = np.isfinite(scene.mu)
    answered = slides & np.isfinite(answer.mu_kinetic)
    good = np.array([status.good for status in FrictionStatus])[answer.status] & answered
    error, static_error = np.abs(answer.mu_kinetic - scene.mu), np.abs(answer.mu_static - scene.static)
    peaks = slides & np.isfinite(scene.static)
    started = peaks & np.isfinite(answer.mu_static)
    shares = [
        float(part[rows].mean()) if rows.any() else float("nan")
        for part, rows in (
            (answered, slides), (good, slides), (error <= 2 * answer.mu_kinetic_sigma, answered),
            (error > FALSE * scene.mu, good), (started, peaks), (static_error <= 2 * answer.mu_static_sigma, started),
        )
    ]  # fmt: skip
    relative = np.array([error, answer.mu_kinetic_sigma])[:, answered] / scene.mu[answered]
    medians = np.median(relative, axis=1) if answered.any() else np.full(2, np.nan)
    return Judged(*shares[:4], *map(float, medians), *shares[4:])


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


def _given(rng: np.random.Generator, name: str) -> Any:
    """The parameters of a part of a random log."""
    return settings.SettingsTable(settings.drawn(RULES["drawn"][name], rng))


def _move(rng, kind: str, time: np.ndarray) -> np.ndarray:
    """(n,) velocity in mm/s."""
    speed, own = _given(rng, "speed"), _given(rng, kind)
    top, ramp = speed.top_mm_s, speed.ramp_s
    if kind == "one way":
        phase = (time + own.begin * own.rest_s) % (own.rest_s + own.slide_s)
        return top * np.clip((phase - own.rest_s) / ramp, 0, 1) * (1 + own.waver * np.sin(own.waver_rad_s * time))
    if kind == "strokes":
        turn, phase = np.divmod(time + own.begin * own.slide_s, own.rests * own.rest_s + own.slide_s)
        way = np.where(turn % 2 < 1, 1.0, -1.0)
        if own.sine:
            return way * top * np.sin(np.pi * np.clip(phase / own.slide_s, 0, 1))
        return way * top * np.clip(np.minimum(phase, own.slide_s - phase) / ramp, 0, 1)
    swing = np.sin(2 * np.pi * own.first_Hz * time + own.first_rad)
    swing += own.second * np.sin(2 * np.pi * own.second_Hz * time + own.second_rad)
    swing += own.one_way
    return top * np.sign(swing) * np.maximum(np.abs(swing) - own.dead_zone, 0.0)


def _press(rng, kind: str, time: np.ndarray, hand: bool) -> np.ndarray:
    """(n,) normal force in N, 0 in the air."""
    own = _given(rng, "force")
    force = np.full(len(time), own.mean_N) * (1 + own.ripple * np.sin(own.ripple_rad_s * time))
    for _ in range(3 if kind != "constant" or hand else 0):
        swing = _given(rng, "swing")
        force *= 1 + swing.depth * np.sin(2 * np.pi * swing.rate_Hz * time + swing.angle_rad)
    if kind == "lifted off":
        own = _given(rng, "lifts")
        phase = (time + own.begin * own.period_s) % own.period_s
        force *= np.clip((np.minimum(phase, own.period_s - phase) - own.air_s / 2) / own.ramp_s, 0, 1)
    elif _given(rng, "touch_down").late:
        own = _given(rng, "late_touch_down")
        force *= np.clip((time - own.begin_s) / own.ramp_s, 0, 1)
    return force


def _law(rng, kind: str, time, force, velocity) -> np.ndarray:
    """(n,) kinetic coefficient."""
    mu = np.full(len(time), _given(rng, "mu").mu)
    every = kind == "all of these"
    if kind == "by force" or every:
        own = _given(rng, "by force")
        mu *= np.maximum(force / np.median(force[force > 0]), own.least) ** -own.power
    if kind == "by speed" or every:
        own = _given(rng, "by speed")
        mu *= 1 + own.change * np.exp(-np.abs(velocity) / own.speed_mm_s)
    if kind == "by wear" or every:
        own = _given(rng, "by wear")
        mu *= 1 + own.change * np.clip((time - own.begin * time[-1]) / min(own.length_s, time[-1]), 0, 1)
    return mu


def _break_away(rng, rate: float, velocity, mu, pull, force, slides) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,) static coefficient of the last start; pull and sliding, with breakaways in half of the draws."""
    static, pull, slides = np.full(len(mu), np.nan), pull.copy(), slides.copy()
    if _given(rng, "no_breakaways").none:
        return static, pull, slides
    own = _given(rng, "breakaway")
    half = max(round(0.5 * rate * own.length_s), 1)
    for start in np.flatnonzero(slides[1:] & ~slides[:-1]) + 1:
        # A finger that touches while moving has no breakaway
        if (force[max(start - round(0.2 * rate), 0) : start] < TOUCHING_N).any():
            continue
        peak = slice(start, min(start + 2 * half, len(mu)))
        rows = np.arange(peak.start, peak.stop)
        pull[peak] += own.more * (1 - np.abs(rows - start - half) / half) * (mu * force * np.sign(velocity))[peak]
        slides[peak] = False
        top = min(start + half, len(mu) - 1)
        static[peak.stop :] = abs(pull[top]) / max(force[top], 1e-9)
    return static, pull, slides


def drawn(seed: int) -> Rubbed:
    """A scene with random kinds."""
    rng = np.random.default_rng(seed)
    kinds = settings.drawn(RULES["drawn"]["log"], rng)
    move, press, law = kinds.values()
    clock = _given(rng, "clock_of_a_hand" if move == "hand" else "clock")
    rate = clock.rate_Hz
    time = np.arange(round(clock.seconds * rate)) / rate
    velocity, force = _move(rng, move, time), _press(rng, press, time, move == "hand")
    mu = _law(rng, law, time, force, velocity)
    skin = _given(rng, "skin")
    mu = mu * (1 + skin.one_way * np.sign(velocity))
    pull = sheared(mu * force, velocity, rate, skin.shear_mm)
    slides = (velocity != 0) & (np.abs(pull) > SLIDING * mu * force) & (force > TOUCHING_N)
    if skin.let_go:
        pull = np.where(velocity == 0, _given(rng, "rest").pull * mu * force, pull)
    if law in ("ridges", "all of these"):
        ridges = _given(rng, "ridges")
        pull *= 1 + ridges.depth * np.sin(2 * np.pi * (np.cumsum(velocity) / rate) / ridges.pitch_mm)
    static, pull, slides = _break_away(rng, rate, velocity, mu, pull, force, slides)
    offset, told = _given(rng, "offset"), {}
    if offset.subtracted:
        offset = _given(rng, "subtracted_offset")
        told = {"offset_sigma_N": offset.offset_sigma_N}
    scale, noise = float(np.median(force[force > 0])), _given(rng, "noise")
    tangential = pull + offset.offset_N + rng.normal(0, noise.tangential * scale, len(time))
    normal = force + rng.normal(0, noise.normal * scale, len(time))
    seen = velocity + rng.normal(0, _given(rng, "velocity").noise * np.abs(velocity).max(), len(time))
    if _given(rng, "seen").direction_alone:
        seen = np.sign(velocity)
    both = (velocity[slides] > 0).any() and (velocity[slides] < 0).any()
    air = (force < 1e-6).sum() > 0.15 * rate
    rest = skin.let_go and ((velocity == 0) & (force > TOUCHING_N)).sum() > 0.3 * rate
    return Rubbed(
        rate, np.column_stack([tangential, normal, seen]), np.where(slides, mu, np.nan), offset.offset_N, static,
        told=bool(both or air or rest or told), options=told, kinds=(move, press, law),
    )  # fmt: skip


# ---- Logs of one form each: pull without offset and noise, force and velocity (n,), and true mu (n,)

Form = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def _tribometer(own: Any, time: np.ndarray) -> Form:
    speed = np.repeat(np.sort(own.speed_mm_s), len(time) // len(own.speed_mm_s))
    normal = own.force_N + own.waver_N * np.sin(2 * np.pi * own.waver_Hz * time) + own.force_noise_N
    running_in = 1 + own.running_in * (1 - np.exp(-time / own.running_in_s))
    mu = own.mu * (1 + own.mu_by_ln_speed * np.log(speed / speed[0])) * running_in
    pull = mu * own.force_N + own.slope_with_force * (normal - own.force_N)
    return pull, normal, speed, np.where(time < own.settling_s, np.nan, mu)


def _long_strokes(own: Any, time: np.ndarray) -> Form:
    turn, phase = np.divmod(time, own.period_s)
    way, moving = np.where(turn % 2 < 1, 1.0, -1.0), phase < own.stroke_s
    normal = own.force_N * (1 + own.force_waver * np.sin(2 * np.pi * own.waver_Hz * time + own.waver_rad))
    fades = np.exp(-(phase - own.stroke_s) / own.fade_s) * ~moving + moving * (1 - np.exp(-phase / own.rise_s))
    true = np.where(moving & (phase > own.settling_s), own.mu, np.nan)
    return way * own.mu * normal * fades, normal, way * (moving if own.rests else 1.0), true


def _swipe(own: Any, time: np.ndarray) -> Form:
    """The pull grows during the rest; the breakaway is a triangle."""
    normal = own.force_N * (1 + own.force_waver * np.sin(own.force_rad_s * time))
    velocity = own.speed_mm_s * np.clip((time - own.begin_s) / own.speed_rise_s, 0, 1)
    velocity = velocity * (1 + own.speed_waver * np.sin(own.speed_rad_s * time))
    mu = own.mu_first + (own.mu_last - own.mu_first) * np.clip(time - own.falls_at_s, 0, 1)
    grown = np.clip((time - own.begin_s + own.pull_rise_s) / own.pull_rise_s, 0, 1)
    peak = np.clip(1 - np.abs(time - own.begin_s) / (0.5 * own.peak_s), 0, 1)
    pull = (grown * mu + (own.mu_static - own.mu_first) * peak) * normal
    return pull, normal, velocity, np.where(time > own.begin_s + own.settling_s, mu, np.nan)


def _encoder(own: Any, time: np.ndarray) -> Form:
    place = own.reach_mm * np.sin(2 * np.pi * own.stroke_Hz * time)
    velocity, count = np.gradient(place, time), own.count_mm
    raw = np.gradient(np.round((place + own.noise_counts * count * own.unit_noise) / count) * count, time)
    normal = own.force_N * (1 + own.force_waver * np.sin(own.force_rad_s * time))
    pull = sheared(own.mu * normal, velocity, own.rate_Hz, own.shear_mm)
    return pull, normal, raw, np.where(np.abs(pull) > SLIDING * own.mu * normal, own.mu, np.nan)


def _by_force(own: Any, time: np.ndarray) -> Form:
    normal = own.force_N * (1 + own.force_waver * np.sin(2 * np.pi * own.waver_Hz * time + own.waver_rad))
    way, phase = np.where(time % own.period_s < own.stroke_s, 1.0, -1.0), time % own.stroke_s
    velocity = own.speed_mm_s * way * (phase > own.rest_s)
    pull = sheared(own.mu * (normal / normal.mean()) ** -own.power * normal, velocity, own.rate_Hz, own.shear_mm)
    return pull, normal, velocity, np.where((velocity != 0) & (phase > own.settled_s), own.mu, np.nan)


FORMS = {form.__name__[1:]: form for form in (_tribometer, _long_strokes, _swipe, _encoder, _by_force)}


def _named(name: str, seed: int) -> Rubbed:
    """A log of `NAMED`."""
    rules = RULES["named"].get(RULES["named"][name].get("like"), {}) | RULES["named"][name]
    own = values = settings.SettingsTable(settings.drawn(rules, np.random.default_rng(seed)))
    time = np.arange(round(own.seconds * own.rate_Hz)) / own.rate_Hz
    pull, normal, velocity, mu = FORMS[own.form](own, time)
    samples, offset = np.column_stack([pull + own.offset_N + own.noise_N, normal, velocity]), own.offset_N
    if "noise_N_and_mm_s" in values:
        samples[:, 1:] += own.noise_N_and_mm_s
    if "subtracted" in values:
        samples[:, 0], offset = samples[:, 0] - offset, 0.0
    options = {key: values[key] for key in ("offset_sigma_N",) if key in values}
    static, known = np.array(values.get("mu_static", np.nan)), values.get("offset_known", True)
    return Rubbed(own.rate_Hz, samples, mu, offset, static, known, options, (own.label,))


NAMED = {name: partial(_named, name) for name in RULES["named"]}  # On which an estimator was found wrong
