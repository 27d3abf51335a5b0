"""Delay and loss: how late each display is, what it tells of the wavelength, and what it costs to send."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from papilla.telepresence.link import LinkModel
from papilla.telepresence.loop import Set, run
from papilla.telepresence.motion import Motion
from papilla.telepresence.texture import GratingTexture, SideBySide

ROUND_TRIPS_MS = (0.0, 60.0, 120.0, 250.0, 500.0)
LOSSES = (0.0, 0.1, 0.3)


class DelayRow(NamedTuple):
    """A link, by its round trip and the share it loses each way; then for each display, local and direct: lag behind
    the hand in ms, wavelength error and share of silent time as fractions, payload in bytes a second."""

    round_trip_ms: float
    loss: float
    lag_ms: dict[str, float]
    wavelength_error: dict[str, float]
    silent: dict[str, float]
    bytes_per_s: dict[str, float]


def delays_and_losses(
    round_trips_ms: Sequence[float] = ROUND_TRIPS_MS,
    losses: Sequence[float] = LOSSES,
    *,
    wavelength_mm: float = 1.2,
    seconds: float = 5.0,
    seed: int = 0,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[DelayRow]:
    """The loop over links of all these delays (half of the round trip each way) and losses, in natural touch."""
    rows: list[DelayRow] = []
    total = len(round_trips_ms) * len(losses)
    for trip in round_trips_ms:
        for loss in losses:
            progress(len(rows), total)
            way = LinkModel(one_way_ms=trip / 2, loss=loss)
            record = run(Set(GratingTexture(wavelength_mm), seconds=seconds, uplink=way, downlink=way, seed=seed))
            felt = {name: record.felt(name) for name in ("local", "direct")}
            rows.append(
                DelayRow(
                    trip,
                    loss,
                    {name: record.lag_ms(name) for name in felt},
                    {name: own.error for name, own in felt.items()},
                    {name: own.silent for name, own in felt.items()},
                    record.bytes_per_s,
                )
            )
    return rows


class BesideEachOther(NamedTuple):
    """Two gratings side by side: ms until each display has the one that the hand came onto within 10 %, and for how
    many ms it still had the other; the same of the local model without any delay, which is what estimating takes.
    Medians over the crossings; never : share of them after which the local model had it not until the next."""

    change_ms: dict[str, float]
    stale_ms: dict[str, float]
    without_link_ms: float
    stale_without_link_ms: float
    never: float


def beside_each_other(
    first_mm: float = 1.0,
    second_mm: float = 4.0,
    *,
    speed_mm_s: float = 87.0,
    strokes_Hz: float = 0.0,
    seconds: float = 3.5,
    round_trip_ms: float = 120.0,
    seed: int = 0,
) -> BesideEachOther:
    """The border between two gratings as in Okamoto et al. 2007, figure 5, felt through each display.

    By default it is crossed once, at a constant speed; with strokes to and fro, in the middle of each. The speed is not
    100 mm/s: at that a wavelength of 1 mm gives 100 Hz, which the estimators take for the mains.
    """
    way, motion = LinkModel(one_way_ms=round_trip_ms / 2), Motion(speed_mm_s, strokes_Hz)
    border = 0.5 * motion.length_mm if strokes_Hz else 1.5 * speed_mm_s
    texture = SideBySide(GratingTexture(first_mm), GratingTexture(second_mm), border)
    delayed, at_once = (run(Set(texture, motion, seconds, link, link, seed=seed)) for link in (way, LinkModel()))
    both = ("local", "direct")
    return BesideEachOther(
        {name: delayed.change_ms(name) for name in both},
        {name: delayed.stale_ms(name) for name in both},
        at_once.change_ms("local"),
        at_once.stale_ms("local"),
        float(np.isnan(delayed.crossings("local")[:, 1]).mean()),
    )
