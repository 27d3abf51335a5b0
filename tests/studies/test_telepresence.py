"""The papers' telepresence experiments: what they display, and loops over delay and loss."""

import numpy as np
import pytest

from papilla.studies.telepresence import beside_each_other, experiments_2011
from papilla.studies.telepresence.roughness import TESTS_MM
from papilla.studies.telepresence.soak import growth, soak
from papilla.studies.telepresence.timing import periods
from papilla.telepresence.link import LinkModel
from papilla.telepresence.loop import Set, run
from papilla.telepresence.texture import GratingTexture


@pytest.mark.slow
def test_the_four_experiments_of_2011_display_what_the_paper_judges():
    found = experiments_2011(seconds=2.5)
    assert np.abs(found[2].felt_mm / TESTS_MM - 1).max() < 0.1
    assert np.abs(found[4].lag_ms).max() < 2 and found[3].lag_ms.min() > 60
    assert np.argmax(found[2].amplitude_um) in (1, 2, 3), "the amplitude has a local maximum at 1.0 to 1.4 mm"
    assert found[1].records is not found[3].records and len(found[1].records) == len(TESTS_MM)


@pytest.mark.slow
@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_loss_does_not_make_the_local_model_late(loss):
    way = LinkModel(one_way_ms=100.0, loss=loss)
    record = run(Set(GratingTexture(1.2), seconds=3, uplink=way, downlink=way))
    assert abs(record.lag_ms("local")) < 2 and record.lag_ms("direct") == pytest.approx(200, abs=10)
    assert record.felt("local").error < 0.05 < record.felt("direct").error


@pytest.mark.slow
def test_another_texture_reaches_the_local_model_after_the_direct_display():
    found = beside_each_other(round_trip_ms=100)
    assert found.change_ms["direct"] == pytest.approx(100, abs=5)
    assert found.change_ms["direct"] < found.change_ms["local"] < 1500
    assert 0 < found.stale_without_link_ms < found.without_link_ms < 1000
    assert found.stale_ms["local"] >= 100, "the old texture is displayed for a round trip at least"
    assert found.stale_ms["direct"] == pytest.approx(100, abs=5) and found.never == 0


def test_growth_is_a_slope_with_its_sigma():
    rng, times = np.random.default_rng(0), np.linspace(0, 2, 200)
    for slope in (0.0, 5.0):
        found = [growth(times, 100 + slope * times + rng.normal(0, 0.5, 200)) for _ in range(40)]
        off = [(value - slope) / sigma for value, sigma in found]
        assert np.abs(np.mean(off)) < 1 and 0.5 < np.std(off) < 2.5
    filling = 100 - 30 * np.exp(-times / 0.02)
    assert abs(growth(times, filling)[0]) < 0.01, "what fills at the begin is no growth"


@pytest.mark.slow
def test_a_display_that_runs_holds_no_more_with_time():
    row = soak("display", 0.006)
    assert row.side == "display" and row.periods == 21_600 and row.memory_MB > 10
    assert row.growth_blocks < 5e4, "one a message would be 1.8e5 an hour, one a period 3.6e6"


@pytest.mark.slow
def test_a_side_that_keeps_something_each_period_is_found_out(monkeypatch):
    from papilla.telepresence import Motion

    kept, place = [], Motion.place_mm
    monkeypatch.setattr(Motion, "place_mm", lambda self, time: kept.append(object()) or place(self, time))
    row = soak("display", 0.002)
    assert row.growth_blocks == pytest.approx(3.6e6, rel=0.2)


@pytest.mark.slow
def test_both_sides_are_timed_as_processes():
    rows = periods(1.5, load=1)
    assert [(row.side, row.load) for row in rows] == [("sensor", 0), ("display", 0), ("sensor", 1), ("display", 1)]
    assert all(row.periods > 0 and 0 < row.p50_ms <= row.p99_9_ms for row in rows)
