"""Figures from made-up slides and presses show what they showed when the pins were written.

`python tests/papers/figures/test_pinned_figures.py [part ...]` (with tests/support on the path) writes the present
numbers, for a change that moves them on purpose.
"""

import functools
import sys
from pathlib import Path
from types import SimpleNamespace

import made_up_finger
import numpy as np
import pinned
import pytest

from papilla import fem
from papilla_papers import grating_signals
from papilla_papers.claims.experiments import gratings, impulses, softness
from papilla_papers.figures import paper_2006, paper_2007, paper_oddo, paper_okamoto, paper_textiles
from papilla_papers.telepresence import TESTS_MM, Condition

KEPT = Path(__file__).with_name("pinned_figures.json")


def silent(*_) -> None:
    """Tells nothing."""


def _read(texture, place, gauges: int, depth: float, ridges: float = 1.0):
    """Readings (n, g): the texture under each gauge, as deep as it is pressed, and the ridges."""
    at = place[:, None] + np.linspace(-2, 2, gauges)
    low, high = texture.span
    sizes = 100 * depth * (1 + 0.1 * np.arange(gauges))
    return sizes * texture.recess(np.clip(at, low, high)) + 3 * ridges * np.sin(2 * np.pi * at / 1.2)


def _slides(patch) -> None:
    """The slides of the gratings' experiment, and those of the figures."""

    def slid(assumed, texture, motion, depth, *, smooth=False, **how):
        place = motion.position_mm
        readings = _read(texture, place, 5 + len(gratings.MORE_GRIDS), depth, 0.0 if smooth else 1.0)
        readings = readings + how.get("friction", assumed.friction) * 0.1 * place[:, None]
        readings = readings + 2 * assumed.loss_factor * motion.rate_Hz / 1000 * np.cos(place)[:, None]
        return gratings.Felt(place, readings, 0.3 * depth, how.get("dynamics", "made up"), "ok: made up")

    def default_slide(texture, motion, friction=0.3, **how):
        readings = _read(texture, motion.position_mm, 5, how.get("depth") or how.get("force"))
        return SimpleNamespace(readings=readings, amplified=1.1 * readings)

    patch.setattr(gratings, "slid", slid)
    patch.setattr(gratings, "default_slide", default_slide)
    patch.setattr(fem, "prepare_section", lambda finger: "section")


def _presses(patch) -> None:
    made_up_finger.instead_of_fem(patch)
    patch.setattr(softness, "cached_sweep", made_up_finger.sweep)
    patch.setattr(paper_2006, "contact_profile", lambda reduced, press: lambda points: press.peak_pressure * np.sqrt(
        np.maximum(1 - np.pi * (points**2).sum(axis=1) / press.contact_area, 0)))  # fmt: skip


def _synthetic(patch) -> None:
    """Scenes of finite elements are those of a synthetic gauge with other noise; strokes are computed anew."""
    real = paper_2006.noisy_scene

    def noisy(name, wavelength, paper, seed, **how):
        known = "const" if "const" in name or "steady" in name.lower() else "act1"
        return real(name, wavelength, paper, seed, **how) if "FEM" not in name else real(
            known, wavelength, paper, seed + 1, **how)  # fmt: skip

    patch.setattr(paper_2006, "noisy_scene", noisy)
    patch.setattr(paper_2006, "_strokes", functools.cache(paper_2006._strokes.__wrapped__))


def _of_2006(patch):
    _slides(patch)
    _presses(patch)
    _synthetic(patch)
    made = paper_2006.two_grooves, paper_2006.five_gratings, paper_2006.depths, paper_2006.natural_touch
    made += paper_2006.against_spectrum, paper_2006.single_intervals, paper_2006.contacts, paper_2006.spread
    return {one.__name__: one() for one in made}


def _of_2007(patch):
    _slides(patch)
    return {one.__name__: one() for one in (paper_2007.crossings, paper_2007.side_by_side)}


def _of_okamoto(patch):
    _slides(patch)
    patch.setattr(paper_okamoto, "SEEDS", range(1))

    def signals(finger, wavelengths, *, speed_mm_s, **how):
        told.append(how)
        return [SimpleNamespace(fundamental=np.arange(1, 6) * w / (1 + w**3) * speed_mm_s**0.1) for w in wavelengths]

    def experiments():
        place = np.array(TESTS_MM)
        rows = (("direct", False, 0.0), ("local", False, 0.01), ("direct", True, 0.3), ("local", True, 0.02))
        return {
            k: Condition(name, late, 100.0 * late + place, place * (1 + off), 20 + 5 * np.sin(place + k), ())
            for k, (name, late, off) in enumerate(rows, start=1)
        }

    told: list = []
    patch.setattr(paper_okamoto, "signals_over_gratings", signals)
    patch.setattr(paper_okamoto, "_powers", functools.cache(paper_okamoto._powers.__wrapped__))
    patch.setattr(paper_okamoto, "_conditions", experiments)
    made = paper_okamoto.wavelengths, paper_okamoto.power_over_speed, paper_okamoto.power_over_wavelength
    made += paper_okamoto.without_delay, paper_okamoto.with_delay, paper_okamoto.signals
    return {one.__name__: one() for one in made} | {"told": told}


def _of_textiles(patch):
    _slides(patch)
    patch.setattr(paper_textiles, "_records", functools.cache(paper_textiles._records.__wrapped__))
    made = paper_textiles.vibration, paper_textiles.roughness, paper_textiles.contour, paper_textiles.bands
    made += paper_textiles.agreement, paper_textiles.fabrics, paper_textiles.grid
    return {one.__name__: one() for one in made}


def _of_oddo(patch):
    made = paper_oddo.passive_record, paper_oddo.passive_maps, paper_oddo.active_record, paper_oddo.active_maps
    made += paper_oddo.three_gratings, paper_oddo.textiles, paper_oddo.expected
    return {one.__name__: one() for one in made}


def _runs_of_oddo(patch):
    """From eight made-up runs a grating."""
    rng = np.random.default_rng(1)

    def run(period: float) -> paper_oddo.wavelets.ActiveRun:
        frequency = tuple(27 / period + rng.normal(size=20) for _ in range(2))
        windows = tuple(SimpleNamespace(mean_Hz=one.mean(), sd_Hz=one.std(ddof=1), greatest_Hz=one.max(),
                                        least_Hz=one.min()) for one in frequency)  # fmt: skip
        return paper_oddo.wavelets.ActiveRun(period, frequency, windows)

    runs = [run(period) for period in paper_oddo.PERIODS_MM for _ in range(paper_oddo.RUNS)]
    patch.setattr(paper_oddo, "_runs", lambda: runs)
    patch.setattr(
        paper_oddo.wavelets, "campaign", lambda seed, assumed: [*runs[:: -1 if assumed.speed_spread > 0.03 else 1]]
    )
    patch.setattr(paper_oddo.wavelets, "accuracy", lambda runs, left: 90 + left / 10 + runs[0].period_mm)
    made = paper_oddo.every_run, paper_oddo.clusters, paper_oddo.active_table, paper_oddo.neighbours
    return {one.__name__: one() for one in made}


def _experiment(patch, cause=True):
    _slides(patch)
    return gratings.run(silent, cause)


def _varied(patch):
    """Parts with another assumed finger, and a slide itself."""
    _slides(patch)
    other = gratings.Assumed(0.9, sorted(gratings.MORE_GRIDS)[0], 0.4)
    return {
        "curve": gratings._curve(other), "gauges": [other.gauges, gratings.ASSUMED.gauges],
        "levels": gratings._levels(other), "finger": [repr(gratings.finger_of(other, one)) for one in (False, True)],
    }  # fmt: skip


def _slide(patch):
    asked = []

    def slide(finger, texture, motion, **how):
        asked.append({name: str(value) for name, value in how.items()})
        return SimpleNamespace(
            motion=motion, readings=np.outer(motion.position_mm, [1.0, 2.0]), force_N=np.array([0.1, 0.3]),
            dynamics="modal", status="ok",
        )  # fmt: skip

    patch.setattr(gratings.sliding, "slide", slide)
    patch.setattr(gratings, "prepare_section", lambda finger, size_mm: f"section of {finger.ridges} at {size_mm:g} mm")
    patch.setattr(gratings.cache, "fetch", lambda kind, key, make: make())
    patch.setattr(gratings, "_section", gratings._section.__wrapped__)
    motion = fem.Motion.steady(10.0, 0.1)
    felt = gratings.slid(gratings.ASSUMED, gratings.grating(1.5), motion, 0.4, friction=0.1, size_mm=0.3)
    smooth = gratings.slid(gratings.ASSUMED, gratings.grating(1.5), motion, 0.4, smooth=True)
    gratings.default_slide(gratings.grating(1.5), motion, depth=0.2)
    return {"felt": felt, "smooth": smooth, "speed": felt.speed_mm_s, "asked": asked}


def _over_gratings(patch):
    asked = []

    def slide(finger, texture, motion, **how):
        asked.append({name: str(value) for name, value in how.items()} | {"rate": motion.rate_Hz})
        readings = _read(texture, motion.position_mm, 3, 0.5, float(finger.ridges is not None))
        return SimpleNamespace(readings=readings, depth_mm=motion.position_mm, dynamics="modal", status="ok")

    patch.setattr(grating_signals, "slide", slide)
    patch.setattr(grating_signals, "prepare_section", lambda finger: f"section of {finger.ridges}")
    steps = []
    found = grating_signals.signals_over_gratings(
        paper_okamoto.Finger.default(), (1.0, 2.0), pitches_mm=(0.0, 0.6), progress=lambda *step: steps.append(step)
    )
    return {"found": found, "asked": asked, "steps": steps}


def _impulses(patch):
    patch.setattr(impulses, "SEEDS", range(1))
    found = impulses.run(silent)
    return {name: value for name, value in found.items() if name != "computing_ms"}


PARTS = {
    "2006": _of_2006,
    "2007": _of_2007,
    "okamoto": _of_okamoto,
    "textiles": _of_textiles,
    "oddo": _of_oddo,
    "oddo, runs": _runs_of_oddo,
    "gratings": _experiment,
    "gratings without cause": lambda patch: _experiment(patch, False),
    "gratings, other finger": _varied,
    "slide": _slide,
    "signals over gratings": _over_gratings,
    "impulses": _impulses,
}


@pytest.mark.parametrize("part", PARTS)
def test_a_figure_shows_its_numbers(part, monkeypatch):
    assert pinned.same(PARTS[part](monkeypatch), KEPT, part) == []


if __name__ == "__main__":
    pinned.update(PARTS, KEPT, sys.argv[1:])
