"""Two gratings side by side: the time that each display needs to change from one to the other, with and without a
delay."""

from typing import NamedTuple

import numpy as np

from papilla.telepresence.link import LinkModel
from papilla.telepresence.loop import Set, run
from papilla.telepresence.motion import Motion
from papilla.telepresence.touch import GratingTexture, SideBySide


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
