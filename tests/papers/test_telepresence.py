"""The papers' telepresence experiments: what they display, and loops over delay and loss."""

import numpy as np
import pytest

from papilla_papers.telepresence import TESTS_MM, beside_each_other, experiments_2011


@pytest.mark.slow
def test_the_four_experiments_of_2011_display_what_the_paper_judges():
    found = experiments_2011(seconds=2.5)
    assert np.abs(found[2].felt_mm / TESTS_MM - 1).max() < 0.1
    assert np.abs(found[4].lag_ms).max() < 2 and found[3].lag_ms.min() > 60
    assert np.argmax(found[2].amplitude_um) in (1, 2, 3), "the amplitude has a local maximum at 1.0 to 1.4 mm"
    assert found[1].records is not found[3].records and len(found[1].records) == len(TESTS_MM)


def test_another_texture_reaches_the_local_model_after_the_direct_display():
    found = beside_each_other(round_trip_ms=100, seconds=2.5)
    assert found.change_ms["direct"] == pytest.approx(100, abs=5)
    assert found.change_ms["direct"] < found.change_ms["local"] < 1000
    assert 0 < found.stale_without_link_ms < found.without_link_ms < 1000
    assert found.stale_ms["local"] >= 100, "the old texture is displayed for a round trip at least"
    assert found.stale_ms["direct"] == pytest.approx(100, abs=5) and found.never == 0
