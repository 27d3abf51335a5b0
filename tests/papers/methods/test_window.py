"""The window that spectra and wavelets look at: what is in it, when there is something new, when it is torn or dead."""

import math

import numpy as np
import pytest

from papilla_papers.methods.window import SampleWindow


def pushed(window: SampleWindow, rows) -> list[bool]:
    return [window.push(tuple(row)) for row in np.atleast_2d(np.asarray(rows, float).T).T.tolist()]


def test_it_holds_the_last_samples_and_tells_of_new_ones_once_it_is_full():
    window, rows = SampleWindow(1, 10, hop=3, extra=1), np.column_stack([np.arange(25.0), -np.arange(25.0)])
    assert np.flatnonzero(pushed(window, rows)).tolist() == [9, 12, 15, 18, 21, 24]
    np.testing.assert_array_equal(window.samples, rows[-10:].T)
    holed = SampleWindow(1, 4, hop=1, extra=1)
    pushed(holed, [(1.0, 5.0), (math.nan, 6.0), (3.0, math.nan), (4.0, 8.0)])
    np.testing.assert_array_equal(holed.samples, [[1, 1, 3, 4], [5, 6, math.nan, 8]])
    assert holed.gaps == 1


def test_it_is_torn_by_more_than_a_tenth_and_whole_again_behind_it():
    window, readings = SampleWindow(1, 20, hop=1), np.arange(60.0)
    readings[20:23] = math.nan
    torn = []
    for reading in readings:
        window.push((reading,))
        torn.append(window.torn)
    assert np.flatnonzero(torn).tolist() == list(range(22, 40))


@pytest.mark.parametrize("channel", [0, 1])
def test_it_is_dead_while_a_channel_has_one_value_all_over_it(channel):
    """Missing values are that value too; one that moves wakes it up."""
    rows = np.random.default_rng(0).normal(size=(60, 2))
    rows[10:40, channel] = 2.5
    rows[20:25, channel] = math.nan
    window, dead = SampleWindow(2, 12, hop=1), []
    for row in rows.tolist():
        window.push(row)
        dead.append(window.dead)
    assert np.flatnonzero(dead).tolist() == list(range(21, 40))
