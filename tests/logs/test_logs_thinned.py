"""Rows thinned to bins keep every extreme, whatever the blocks."""

import numpy as np
import pytest

from papilla.logs import statistics
from papilla.logs.statistics import Thinned


@pytest.mark.parametrize("blocks", [1, 7, 40])
def test_extremes_survive_and_bins_stay_few(monkeypatch, blocks):
    monkeypatch.setattr(statistics, "BINS", 50)
    rng = np.random.default_rng(2)
    rows = np.column_stack([np.arange(3001.0), rng.normal(size=3001), np.full(3001, np.nan)])
    rows[1234, 1], rows[2345, 1], rows[:40, 1] = 9.0, -9.0, np.nan
    found = Thinned()
    for part in np.array_split(rows, blocks):
        found.add(part)
    found.add(rows[:0])
    low, high = found.low, found.high
    assert 30 < len(low) < 100 and low.shape == high.shape == (len(low), 3)
    assert (np.diff(low[:, 0]) > 0).all() and (low[1:, 0] == high[:-1, 0] + 1).all() and low[0, 0] == 0
    assert np.nanargmax(high[:, 1]) == np.searchsorted(high[:, 0], 1234) and np.nanmax(high[:, 1]) == 9.0
    assert np.nanargmin(low[:, 1]) == np.searchsorted(high[:, 0], 2345) and np.isnan(high[:, 2]).all()
