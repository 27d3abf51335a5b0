"""The 2011 paper on remote tactile transmission, section 5: what its four experiments displayed."""

from collections.abc import Mapping
from functools import cache

import numpy as np

from papilla.studies.figures.picture import Curve, Panel, Picture, Table
from papilla.studies.figures.registry import Figure
from papilla.studies.telepresence.roughness import NOTICED_MS, TESTS_MM, Condition, experiments_2011

NAMES = {1: "direct", 2: "local model", 3: "direct, delayed", 4: "local model, delayed"}
PEAK_MM = 1.4
"""Near which the printed answers of experiments 1 and 2 have a local maximum."""


@cache
def _conditions() -> Mapping[int, Condition]:
    return experiments_2011()


def _cues(first: int, second: int) -> Picture:
    """Wavelength, intensity and lag of two experiments: direct feedback, then the local model."""
    place, own = np.array(TESTS_MM), {NAMES[number]: _conditions()[number] for number in (first, second)}
    match = Curve("match", place[[0, -1]], place[[0, -1]], "dashed", origin="true")
    peak = Curve("printed: answers peak", np.full(2, PEAK_MM), np.array([0.0, 10.0]), "dashed", origin="printed")
    notice = Curve("printed: noticed", place[[0, -1]], np.full(2, NOTICED_MS), "dashed", origin="printed")
    felt = tuple(Curve(name, place, one.felt_mm) for name, one in own.items())
    loud = tuple(Curve("", place, one.amplitude_um) for one in own.values())
    lags = tuple(Curve("", place, one.lag_ms) for one in own.values())
    label = "explored, mm"
    panels = (
        Panel("frequency", label, "wavelength displayed, mm", (match, *felt), y_range=(0, 4.5)),
        Panel("intensity", label, "amplitude, µm", (*loud, *([peak] if first == 1 else [])), y_range=(0, 20)),
        Panel("lag", label, "behind the hand, ms", (*lags, notice), y_range=(-20, 200)),
    )
    words = "; ".join(
        f"{name} {np.nanmean(np.abs(one.felt_mm - place)):.2f} mm off, {np.nanmedian(one.lag_ms):.0f} ms late, "
        f"greatest amplitude at {place[np.argmax(one.amplitude_um)]:g} mm"
        for name, one in own.items()
    )
    return Picture(panels, columns=3, found=f"Mean over seven gratings: {words}.")


def without_delay() -> Picture:
    """Experiments 1 and 2: what direct feedback and the local model display of seven gratings.

    The simulated loop of hand, link, sensor and display; no person is simulated, so there are no answers, but what a
    person could judge by. Left: the wavelength that the displayed signal has over the hand's own motion. Middle: its
    amplitude. Right: its lag behind the hand. The answers are printed in a picture, their numbers are lost in the text
    at hand but for the peak near 1.4 mm.
    """
    return _cues(1, 2)


def with_delay() -> Picture:
    """Experiments 3 and 4: the same with a delay of 120 ms (40 ms standard deviation) on the feedback.

    As figure 15; a new delay is drawn every 200 ms. Direct feedback comes late, which all participants noticed, and
    has no steady wavelength over the hand's own motion; the local model follows the hand.
    """
    return _cues(3, 4)


def signals() -> Picture:
    """The signals behind tables 1 to 4: what is displayed of each grating in the four experiments.

    The values of figures 15 and 16. The answers of the eight participants are lost in the text at hand, and no person
    is simulated.
    """
    rows = tuple(
        (f"{n} ({NAMES[n]})", explored, float(one.felt_mm[k]), float(one.amplitude_um[k]), float(one.lag_ms[k]))
        for n, one in _conditions().items()
        for k, explored in enumerate(TESTS_MM)
    )
    return Picture(table=Table(("experiment", "explored, mm", "displayed, mm", "amplitude, µm", "lag, ms"), rows))


FIGURES = (
    Figure("fig. 15", without_delay, ("C35", "C38"), "felt"),
    Figure("fig. 16", with_delay, ("C36", "C37"), "felt"),
    Figure("tables 1-4", signals, ("C34",), "felt"),
)
