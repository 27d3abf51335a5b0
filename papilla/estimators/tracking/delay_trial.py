"""How sharp the lines in the latest path would be if the path were late by another time.

With a wrong delay T the place is off by v T. Where the speed v changes within a stroke, that smears a line; the right
delay makes it sharp again. At a constant speed a line is equally sharp at any delay, and nothing can be learnt.
"""

from papilla.estimators.spectrum import spectrum_of, strokes_of
from papilla.estimators.spread import Pieces
from papilla.estimators.tracking.line_search import MOST_LINES
from papilla.estimators.tracking.search_task import Task, window_of


def sharpness(task: Task, late_s: float) -> Pieces[float]:
    """Power over the background of the sharpest line if the path were late by `late_s`; 0 if there is none."""
    window = window_of(task, late_s)
    if window is None:
        return 0.0
    strokes = yield from strokes_of(window.place, window.readings, window.begin)
    spectrum = yield from spectrum_of(strokes, task.grid(window.place), task.size)
    lines = yield from spectrum.lines(1 / task.options.high, task.highest(window.place), MOST_LINES)
    return max((line.ratio for line in lines), default=0.0)
