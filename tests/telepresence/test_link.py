"""The simulated link: what its words promise, and that one cause does not move another."""

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.telepresence import Link, LinkModel
from papilla.telepresence.link import HEADER_BYTES


def sent_through(model, seed=0, number=5000, period_s=0.001, size=50):
    link, found = Link(model, seed), []
    for row in range(number):
        link.send(row * period_s, row, size)
        found += link.receive(row * period_s)
    return link, found + link.receive(1e9)


def test_a_drawn_delay_is_truncated_redrawn_at_5_Hz_and_keeps_order():
    link, found = sent_through(LinkModel(one_way_ms=120, one_way_sd_ms=40), period_s=0.01)
    delays = np.array([link.one_way_s(at) for at in np.arange(0.1, 2000, 0.2)])
    assert (
        delays.min() >= 0
        and delays.mean() == pytest.approx(0.12, rel=0.03)
        and delays.std() == pytest.approx(0.04, rel=0.06)
    )
    assert link.one_way_s(0.21) == link.one_way_s(0.39) != link.one_way_s(0.41)
    assert link.one_way_s(-3.0) == link.one_way_s(0.0), "before the start it is the first"
    assert [one.content for one in found] == sorted(one.content for one in found)
    few = Link(LinkModel(one_way_ms=10, one_way_sd_ms=40), 1)
    assert 0 <= min(few.one_way_s(at) for at in np.arange(0, 400, 0.2)) < 1e-3, "any delay from 0 on"


@pytest.mark.parametrize("share", [0.1, 0.3])
def test_loss_and_duplication_are_the_stated_shares(share):
    _, found = sent_through(LinkModel(loss=share), number=20_000)
    assert len(found) / 20_000 == pytest.approx(1 - share, abs=0.02)
    _, found = sent_through(LinkModel(duplication=share), number=20_000)
    assert len(found) / 20_000 == pytest.approx(1 + share, abs=0.02)


def test_reordering_overtakes_and_jitter_does_not():
    _, found = sent_through(LinkModel(one_way_ms=20, reordering=0.1))
    order = [one.content for one in found]
    assert order != sorted(order) and sorted(order) == list(range(5000))
    _, found = sent_through(LinkModel(one_way_ms=20, jitter_ms=5))
    assert [one.content for one in found] == list(range(5000))


def test_the_cap_of_bandwidth_holds_and_what_does_not_fit_is_lost():
    model = LinkModel(bandwidth_bytes_s=10_000, queue_s=0.1)
    link, found = sent_through(model, number=4000, size=50)
    seconds = found[-1].arrived_s
    assert len(found) * (50 + HEADER_BYTES) <= 10_000 * seconds * 1.001
    assert len(found) == pytest.approx(10_000 * 4 / 78, rel=0.05)
    assert max(one.arrived_s - one.sent_s for one in found) <= 0.11
    assert link.lost == 4000 - len(found)


def test_the_same_seed_is_the_same_link_and_loss_leaves_delays_alone():
    model = dict(one_way_ms=50, one_way_sd_ms=20, jitter_ms=2)
    same = [sent_through(LinkModel(**model), seed=3)[1] for _ in range(2)]
    assert same[0] == same[1]
    lossy = {one.content: one.arrived_s for one in sent_through(LinkModel(**model, loss=0.2), seed=3)[1]}
    full = {one.content: one.arrived_s for one in same[0]}
    equal = [lossy[key] == full[key] for key in lossy]
    assert np.mean(equal) > 0.9
    assert sent_through(LinkModel(**model), seed=4)[1] != same[0]


def test_a_datagram_takes_its_bytes_over_the_cap_and_headers_count():
    link = Link(LinkModel(one_way_ms=10, bandwidth_bytes_s=1000), 0)
    for _ in range(2):
        link.send(0.0, "", 72)
    assert [one.arrived_s for one in link.receive(1.0)] == pytest.approx([0.11, 0.21])
    assert (link.sent, link.bytes_sent, link.lost) == (2, 144, 0)
    link.send(1.0, "")
    assert link.receive(2.0)[0].arrived_s == pytest.approx(1.01 + HEADER_BYTES / 1000) and link.bytes_sent == 144


def test_jitter_is_half_normal_and_what_is_overtaken_waits_twenty_milliseconds_at_most():
    # A tenth of a second apart, so that no datagram waits for the one before it
    _, found = sent_through(LinkModel(one_way_ms=20, jitter_ms=5), period_s=0.1)
    waits = np.array([one.arrived_s - one.sent_s for one in found]) - 0.02
    assert waits.min() >= -1e-9 and np.sqrt(np.mean(waits**2)) == pytest.approx(0.005, rel=0.03)
    _, found = sent_through(LinkModel(one_way_ms=20, reordering=0.4), period_s=0.1)
    waits = np.array([one.arrived_s - one.sent_s for one in found]) - 0.02
    late = waits[waits > 1e-9]
    assert late.size / waits.size == pytest.approx(0.4, abs=0.02)
    assert late.mean() == pytest.approx(0.01, rel=0.05) and 0.0199 < late.max() <= 0.02


@pytest.mark.parametrize(
    "values", [{"loss": 1.5}, {"one_way_ms": -1}, {"bandwidth_bytes_s": 0}, {"jitter_ms": float("nan")}]
)
def test_values_out_of_range_are_refused(values):
    with pytest.raises(InputError):
        LinkModel(**values)
