"""The whole loop, simulated: hand, uplink, sensor, downlink, and both displays on the same signals."""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.telepresence.answer import DisplayStatus, Shown, Trust
from papilla.telepresence.direct import DirectFeedback, HighPass
from papilla.telepresence.hand import RemoteHand
from papilla.telepresence.link import HEADER_BYTES, Link, LinkModel
from papilla.telepresence.local_model import LocalModel
from papilla.telepresence.measures import felt_wavelength, lag_s
from papilla.telepresence.messages import (
    VERSION,
    Force,
    HandReading,
    Header,
    Length,
    Parameters,
    Samples,
    encode,
    quantity,
)
from papilla.telepresence.texture import Texture
from papilla.telepresence.touch import Soft, Touch

HAND_HZ, RATE_HZ = 250.0, 1000.0
"""Positions and control periods a second: Okamoto et al. 2011, section 3."""
PARAMETERS_HZ = 50.0
WANDER_HZ = 0.31
"""How often the rate of the strokes wanders."""
PRESS_SWING, PRESS_HZ = 0.4, 0.6
"""By how much and how often the pressing force swings."""
SETTLE_S = 1.0
"""Of the begin, left out of every measure."""


@dataclass(frozen=True)
class Motion:
    """What the hand does: strokes to and fro of this peak speed and rate, or, at 0 Hz, one at a constant speed.

    The default is the touch of Okamoto et al. 2011, section 4.1.1: 197 sin(2 pi 1.07 t) mm/s, of which the rate wanders
    by 10 % and back every 3.2 s as a hand's does. Strokes that repeat exactly would look the same half a stroke later.
    It presses with `press_N` on the mean, which swings by 40 % every 1.7 s.
    """

    peak_mm_s: float = 197.0
    strokes_Hz: float = 1.07
    wander: float = 0.1
    press_N: float = 0.5

    def __post_init__(self):
        checks.within("peak_mm_s", self.peak_mm_s, 1, 1000)
        checks.within("strokes_Hz", self.strokes_Hz, 0, 10)
        checks.within("wander", self.wander, 0, 0.5)
        checks.within("press_N", self.press_N, 0, 100)

    def force_N(self, time_s):
        """Pressing force at a time or times."""
        return self.press_N * (1 + PRESS_SWING * np.sin(2 * math.pi * PRESS_HZ * np.asarray(time_s)))

    @property
    def length_mm(self) -> float:
        """Length of a stroke; infinite at a constant speed."""
        return self.peak_mm_s / (math.pi * self.strokes_Hz) if self.strokes_Hz else math.inf

    def place_mm(self, time_s):
        """Position at a time or times; the strokes begin at 0 and go forth first."""
        if self.strokes_Hz == 0:
            return self.peak_mm_s * np.asarray(time_s)
        time, slow = np.asarray(time_s), 2 * math.pi * WANDER_HZ
        turned = 2 * math.pi * self.strokes_Hz * (time + self.wander / slow * (1 - np.cos(slow * time)))
        return 0.5 * self.length_mm * (1 - np.cos(turned))


@dataclass(frozen=True)
class Set:
    """What is simulated.

    Parameters
    ----------
    texture : under the sensor. motion : of the hand. seconds : how long.
    uplink, downlink : one way each, hand to sensor and sensor to display.
    noise_microstrain : standard deviation of a reading. components : of the local model.
    parameters_Hz : messages to the local model a second. seed : of noise and links.
    start_mm : place of the texture under the hand's 0.
    soft : what is under the texture, and the calibrated finger that feels it; None: one gauge, the texture alone.
    """

    texture: Texture
    motion: Motion = field(default_factory=Motion)
    seconds: float = 8.0
    uplink: LinkModel = field(default_factory=LinkModel)
    downlink: LinkModel = field(default_factory=LinkModel)
    noise_microstrain: float = 3.5
    components: int = 1
    parameters_Hz: float = PARAMETERS_HZ
    seed: int = 0
    start_mm: float = 0.0
    soft: Soft | None = None

    def __post_init__(self):
        checks.within("seconds", self.seconds, 2, 3600)
        checks.within("parameters_Hz", self.parameters_Hz, 1, RATE_HZ)


class Record(NamedTuple):
    """(n,) a row per ms: time_s, hand_mm and truth_mm (wavelength under the hand); displacement in um of each display;
    wavelength_mm of the local model, direct_mm that of the texture where the displayed sample was taken; status of
    both. bytes_per_s : payload of messages down, `with_headers` with those of UDP and IPv4; round_trip_ms (n,) : how
    long ago the hand was where the displayed sample was taken, what the links' queues add included; lost : share of
    what was sent down; told (n,) : the last message that had arrived."""

    time_s: np.ndarray
    hand_mm: np.ndarray
    truth_mm: np.ndarray
    local_um: np.ndarray
    direct_um: np.ndarray
    wavelength_mm: np.ndarray
    direct_mm: np.ndarray
    local_status: np.ndarray
    direct_status: np.ndarray
    bytes_per_s: dict[str, float]
    with_headers: dict[str, float]
    round_trip_ms: np.ndarray
    lost: dict[str, float]
    told: list[Parameters | None]

    @property
    def judged(self) -> slice:
        """Rows after the begin."""
        return slice(int(np.searchsorted(self.time_s, SETTLE_S)), None)

    @property
    def late_ms(self) -> float:
        """The median round trip after the begin."""
        late = self.round_trip_ms[self.judged]
        return float(np.median(late[np.isfinite(late)])) if np.isfinite(late).any() else math.nan

    def lag_ms(self, which: str) -> float:
        """Lag of a display ("local" or "direct") behind the hand."""
        rows, shown = self.judged, self.local_um if which == "local" else self.direct_um
        steps = np.diff(self.hand_mm, prepend=self.hand_mm[0])
        turns = np.cumsum(np.nan_to_num(steps / self.truth_mm))
        late_ms = self.late_ms if math.isfinite(self.late_ms) else 0.0
        longest = min(1.5e-3 * late_ms + 0.3, 0.4 * self.time_s[-1])
        return 1e3 * lag_s(shown[rows], turns[rows], self.hand_mm[rows], RATE_HZ, longest)

    def felt(self, which: str):
        """`Felt` of a display: the wavelength that it has over the hand's own path."""
        rows, shown = self.judged, self.local_um if which == "local" else self.direct_um
        return felt_wavelength(shown[rows], self.hand_mm[rows], self.truth_mm[rows], RATE_HZ)

    def crossings(self, which: str, within: float = 0.1) -> np.ndarray:
        """(m, 2) of each time the hand comes onto another texture: for how many ms the display still has the wavelength
        of the old one within 10 %, and after how many it has that of the new one; NaN where it has not until the next.
        """
        shown = self.wavelength_mm if which == "local" else self.direct_mm
        places = np.flatnonzero(np.abs(np.diff(self.truth_mm)) > 0) + 1
        found = []
        for begin, end in itertools.pairwise([*places.tolist(), len(shown)]):
            old, new = (np.abs(shown[begin:end] / self.truth_mm[row] - 1) < within for row in (begin - 1, begin))
            found.append([np.argmin(old) if not old.all() else math.nan, np.argmax(new) if new.any() else math.nan])
        return np.array(found).reshape(-1, 2) * 1e3 / RATE_HZ

    def stale_ms(self, which: str) -> float:
        """For how long a display still has the old texture after a crossing: the median; NaN without any."""
        return _median(self.crossings(which)[:, 0])

    def change_ms(self, which: str) -> float:
        """After how long a display has the new texture: the median; NaN where that is never, or without a crossing."""
        return _median(self.crossings(which)[:, 1])

    def statuses(self, which: str) -> dict[str, float]:
        """Share of the rows of each status, by its sentence."""
        codes, counts = np.unique(self.local_status if which == "local" else self.direct_status, return_counts=True)
        return {
            DisplayStatus(int(code)).sentence: float(count) / self.time_s.size
            for code, count in zip(codes, counts, strict=True)
        }


def _median(times) -> float:
    """The median of times, of which those that never come (NaN) are the latest; NaN where it is one of these."""
    found = np.sort(np.where(np.isnan(times), math.inf, times))
    middle = float(found[len(found) // 2]) if len(found) else math.inf
    return middle if math.isfinite(middle) else math.nan


class Headers:
    """Headers of one side of a simulated link, where nobody has to prove anything."""

    def __init__(self, session: int):
        self.session, self._sequence = session, itertools.count(1)

    def next(self, time_s: float) -> Header:
        """The header of a message sent at this time; its numbers are as long as those of a real run."""
        own, now = 2**62 + self.session, 2**45 + round(1e9 * time_s)
        return Header(VERSION, own, next(self._sequence), now, own + 1, now, 1_000_000)


def run(
    scene: Set,
    local: LocalModel | None = None,
    direct: DirectFeedback | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Record:
    """Simulate the loop: both displays hear the same sensor over links of the same model and seed.

    `progress` is called now and then with the seconds that are done, and all.

    Raises `InputError` where the strokes leave a recorded texture.
    """
    local = LocalModel(components=scene.components) if local is None else local
    direct = DirectFeedback() if direct is None else direct
    seeds = np.random.SeedSequence(scene.seed).generate_state(3)
    uplink, noise = Link(scene.uplink, int(seeds[0])), np.random.default_rng(int(seeds[2]))
    # The same seed: the delays of both are the same at any time, each has losses of its own datagrams.
    down = {name: Link(scene.downlink, int(seeds[1])) for name in ("local", "direct")}
    touch, remote, pressing = Touch(scene.texture, scene.noise_microstrain, scene.soft), RemoteHand(), math.nan
    sensing, coupled = touch.sensing(scene.components), HighPass(RATE_HZ) if scene.soft else float
    headers = {name: Headers(number) for number, name in enumerate(("hand", "local", "direct"))}
    time = np.arange(round(scene.seconds * RATE_HZ)) / RATE_HZ
    hand = np.asarray(scene.motion.place_mm(time)) + scene.start_mm
    forces = scene.motion.force_N(time).tolist()
    normal = noise.standard_normal((time.size, touch.numbers)).tolist()
    hand_every, told_every = round(RATE_HZ / HAND_HZ), round(RATE_HZ / scene.parameters_Hz)
    shown_local, shown_direct, displayed, newest = [], [], [], (math.nan, math.nan)
    learnt = []
    learnt_s = heard_s = -math.inf
    told: Parameters | None = None
    for row, now in enumerate(time.tolist()):
        if row % 250 == 0:
            progress(round(now), round(scene.seconds))
        if row % hand_every == 0:
            place, force = float(hand[row]), forces[row]
            local.move(now, place, force)
            message = HandReading(headers["hand"].next(now), quantity(Length, place), quantity(Force, force))
            uplink.send(now, (place, force), len(encode(message)))
        for sent, arrived, (place, force) in uplink.receive(now):
            remote.read(arrived, sent, place)
            pressing = force
        place, speed = remote.at(now)
        if math.isfinite(place):
            sampled = touch.row(place, speed, pressing, normal[row])
            if not math.isfinite(sampled[0]):
                raise InputError(
                    f"there is no reading at {place:.3g} mm and {pressing:.3g} N: make the strokes of the hand "
                    "shorter, or press within the calibrated forces"
                )
            sensing.update((now, *sampled))
            reading = coupled(sampled[0])
            sample = Samples(headers["direct"].next(now), 1_000_000, (reading,))
            down["direct"].send(now, (reading, place, remote.playing_s), len(encode(sample)))
        if row % told_every == 0:
            parameters = sensing.parameters(headers["local"].next(now))
            down["local"].send(now, parameters, len(encode(parameters)))
        # What was overtaken or came twice is left out, as `gate.Gate` does.
        for delivery in down["local"].receive(now):
            if delivery.sent_s > learnt_s:
                told, learnt_s = delivery.content, delivery.sent_s
                local.learn(now, told.components, Trust(told.texture))
        for delivery in down["direct"].receive(now):
            if delivery.sent_s > heard_s:
                (reading, place, played), heard_s = delivery.content, delivery.sent_s
                newest = scene.texture.wavelength(place), played
                direct.hear(now, reading)
        learnt.append(told)
        shown_local.append(local.update(now))
        shown_direct.append(direct.update(now))
        displayed.append((newest[0], 1e3 * (now - newest[1])))
    return _record(scene, time, hand, (shown_local, shown_direct), np.array(displayed), down, learnt)


def _record(
    scene: Set, time, hand, shown: tuple[list[Shown], list[Shown]], displayed, down: dict[str, Link], told
) -> Record:
    """A run as arrays; displayed (n, 2): wavelength under the sensor at the displayed sample, and its age in ms."""
    local, direct = shown
    truth = np.array([scene.texture.wavelength(place) for place in hand.tolist()])
    return Record(
        time_s=time,
        hand_mm=hand,
        truth_mm=truth,
        local_um=np.array([one.displacement_um for one in local]),
        direct_um=np.array([one.displacement_um for one in direct]),
        wavelength_mm=np.array([one.wavelength_mm if one.gain > 0 else math.nan for one in local]),
        direct_mm=displayed[:, 0],
        local_status=np.array([one.status for one in local]),
        direct_status=np.array([one.status for one in direct]),
        bytes_per_s={name: link.bytes_sent / scene.seconds for name, link in down.items()},
        with_headers={
            name: (link.bytes_sent + HEADER_BYTES * link.sent) / scene.seconds for name, link in down.items()
        },
        round_trip_ms=displayed[:, 1],
        lost={name: link.lost / max(1, link.sent) for name, link in down.items()},
        told=told,
    )
