"""Delay and loss: how late each display is, what it tells of the wavelength, and what it costs to send."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from papilla.telepresence.link import LinkModel
from papilla.telepresence.loop import Motion, Set, run
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
    """Two gratings side by side, crossed at constant speed: ms until each display has the second one's wavelength
    within 10 %; without_link_ms : the same of the local model without any delay, which is what estimating takes."""

    change_ms: dict[str, float]
    without_link_ms: float


def beside_each_other(
    first_mm: float = 1.0,
    second_mm: float = 4.0,
    *,
    speed_mm_s: float = 87.0,
    round_trip_ms: float = 120.0,
    seed: int = 0,
) -> BesideEachOther:
    """The border between two gratings as in Okamoto et al. 2007, figure 5, felt through each display.

    The speed is not 100 mm/s: at that a wavelength of 1 mm gives 100 Hz, which the estimators take for the mains.
    """
    way = LinkModel(one_way_ms=round_trip_ms / 2)

    def crossed(link: LinkModel):
        texture = SideBySide(GratingTexture(first_mm), GratingTexture(second_mm), 1.5 * speed_mm_s)
        return run(Set(texture, Motion(speed_mm_s, 0.0), 3.5, link, link, seed=seed))

    delayed, at_once = crossed(way), crossed(LinkModel())
    return BesideEachOther({name: delayed.change_ms(name) for name in ("local", "direct")}, at_once.change_ms("local"))
