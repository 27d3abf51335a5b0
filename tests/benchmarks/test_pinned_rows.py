"""Estimators that are compared, their rows, drawn figures, elements and structured meshes are what they were.

`python tests/benchmarks/test_pinned_rows.py [part ...]` (with tests/support on the path) writes the present numbers,
for a change that moves them on purpose.
"""

import math
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pinned
import pytest
import scipy.sparse as sp
from artists import shown

from benchmarks.estimators import comparison, methods
from papilla.scenes import scenes
from papilla.verify import elements
from papilla.verify.structured import cube, cylinder, growing, shell
from papilla_papers.claims import claim
from papilla_papers.figures import drawing
from papilla_papers.figures.picture import Curve, Panel, Picture, Shade, Table, as_csv, dashed, printed
from papilla_papers.figures.runner import PAPERS

KEPT = Path(__file__).with_name("pinned_rows.json")


def _meshes(patch):
    """Meshes of flat bodies, of a ball and of the cube."""
    made = [cube(3), cube(4, jitter=0.1, split=True), shell(np.array([1.0, 1.4, 2.0]), 3)]
    made.append(cylinder(np.array([0.0, 0.5, 1.2, 2.0, 3.0]), np.array([0.0, 0.4, 1.0, 2.0]), 2, 3))
    return made, growing(0.2, 1.3, 5.0), growing(0.1, 2.0, 1.0)


def _elements(patch):
    found = {
        "flat": [elements._errors(cube(2), name, nu, False) for name, nu in (("P1", 0.3), ("Taylor-Hood", 0.5))],
        "curved": elements._errors(shell(np.linspace(1, 2, 2), 2), "Taylor-Hood", 0.4, True),
    }
    patch.setattr(elements, "_meshes", lambda boundary, element: [4, 8])
    sizes = lambda mesh, element, nu, curved: (0.1 * mesh**-1.9, (0.3 + curved) * mesh**-1.1)  # noqa: E731
    patch.setattr(elements, "_errors", sizes)
    found["cases"] = [*elements.manufactured()]
    patch.setattr(elements, "build", lambda finger: cube(2))
    rows = sp.csr_matrix(np.linspace(-1, 2, 125 * 2).reshape(2, 125))
    patch.setattr(elements, "strain_functional", lambda *_: SimpleNamespace(points=None, weights=np.ones((2, 3))))
    patch.setattr(
        elements, "curvature_functional", lambda *_: SimpleNamespace(points=None, weights=np.ones((2, 3)) * 2)
    )
    patch.setattr(elements, "interpolation", lambda space, points: rows)
    return found | {"rigid": [*elements._rigid_motions()]}


def _answers(patch):
    """Every method but the pipelines on a second of a grating with drift, in one stroke and in several."""
    found = {}
    for kind in ("const", "act1"):
        made = scenes.scene(kind, 1.8, seed=3, seconds=1.0)
        readings = made.readings + 30 * np.sin(2 * np.pi * made.position_mm[:, None] / 40) + 2 * made.time_s[:, None]
        readings[200:210] = np.nan
        for name, method in methods.METHODS.items():
            if method.kind in (methods.RIVAL, methods.PUBLISHED) or name == "no velocity":
                found[f"{kind}, {name}"] = method.run(made.time_s, readings, made.known_mm_s)
    place, rng = np.linspace(0, 30, 1500), np.random.default_rng(2)
    noise = rng.normal(size=place.size)
    for name, reading in {
        "long": 9 * np.sin(2 * np.pi * place / 14) + np.sin(2 * np.pi * place / 1.1) + 0.1 * noise, "noise": noise,
        "short": np.sin(2 * np.pi * place / 0.3) + 0.3 * np.sin(2 * np.pi * place / 2.2) + 0.1 * noise,
    }.items():  # fmt: skip
        found[name] = [methods.strongest(place, reading, tapered) for tapered in (True, False)]
        found[f"{name}, MUSIC"] = methods.music(place, reading)
    found["too short"] = methods.music(place[:20], noise[:20])
    found["never sure"] = methods.seeded_filter(place / 100, noise, np.full(place.size, 100.0))
    return found


def _rows(patch):
    """Answers that are right, off, late and missing, on scenes with a line, with a change, and without one."""

    def answered(made, seed):
        rng, count = np.random.default_rng(seed), made.time_s.size
        truth = np.nan_to_num(made.wavelength_mm, nan=1.5)
        found = truth * (1 + 0.03 * rng.standard_normal(count)) * np.where(np.arange(count) % 7 == 0, 1.4, 1.0)
        found[: count // 3] = np.nan
        ok = np.isfinite(found) & (rng.random(count) < 0.8)
        return methods.Answer(found, 0.04 * truth, ok, ok & (np.arange(count) % 2 == 0))

    rows, runs = [], {}
    names = [name for name in scenes.SCENES if "FEM" not in name]
    for place, name in enumerate(names[::20]):
        made = [scenes.scene(name, 1.3, seed=seed, seconds=1.5) for seed in (1, 2)]
        for number, (method, path) in enumerate((("pipeline", 20.0), ("STFT over the path", None), ("MUSIC", 9.0))):
            own = [
                comparison.judged(one, answered(one, 10 * place + number + k), path, 3.0 + k)
                for k, one in enumerate(made)
            ]
            runs[f"{name}, {method}"] = own[0]
            rows.append(comparison.row_of(name, method, own))
    told = []
    for row in rows[::3]:
        beside = [one for one in rows if one.scene == row.scene]
        told.append((comparison.targets(row, beside), comparison.faults(row, beside)))
        better = [replace(one, median=0.5 * row.median, over_5=0.01) for one in beside]
        told.append(comparison.targets(row, better))
    waves = [comparison.wavelength_of(seed) for seed in (0, 3, 7, comparison.CLAIMS, comparison.CLAIMS + 1)]
    return rows, runs, told, waves, comparison.LONG, comparison.SHORT


def _compared(patch):
    """Which runs are made."""
    asked = []

    def runs(name, seed, names, plan, say=None):
        asked.append((name, seed, list(names)))
        count = 5
        ones = np.ones(count, bool)
        return [
            comparison.Run(np.full(count, 0.01 * (k + 1) + 0.001 * seed), ones * 1.0, ones, ones, ones, ones, ~ones,
                           0.1 * k, math.nan, 2.0)
            for k in range(len(names))
        ]  # fmt: skip

    def jobs(function, todo, processes):
        return ((name, function(*job)) for name, job in todo.items())

    patch.setattr(comparison, "runs_of", runs)
    patch.setattr(comparison, "run_jobs", jobs)
    steps = []
    plan = comparison.Plan(scenes=("act1",), methods=("pipeline", "MUSIC"), seeds=(1, 5))
    return comparison.compare(plan, workers=2, progress=lambda *step: steps.append(step)), asked, steps


def _picture() -> Picture:
    """Every look of a curve, a map with arrows, bars with names, logarithmic axes."""
    x = np.linspace(0.1, 10, 12)
    curves = (
        Curve("line", x, x**2), Curve("more", x, x, spread=0.1 * x), dashed((0, 9), 4.0, "true"),
        printed("printed", x[:3], x[:3], 2), Curve("points", x, 2 * x, "points", 0.2 * x),
        Curve("", x, 3 * x, color=-1), Curve("hits", x[::3], x[::3], "impulses", color=9),
    )  # fmt: skip
    places = np.arange(3)
    bars = Curve("b1$", places, places + 1, "bars"), Curve("b2", places, places + 2, "bars", np.ones(3))
    value = np.add.outer(np.arange(7.0), 25 * np.arange(8.0) ** 2) - 200
    over = value > 300
    places, heights = np.linspace(0, 4, 8), np.geomspace(1, 30, 7)
    shade = Shade(places, heights, value, "power", over, 0.1 * value, 900.0)
    panels = (
        Panel("one", "x, s", "y, mm", curves, x_range=(0.2, 8), log="xy"),
        Panel("two$", "place", "height", bars, names=("a", "b$", "c"), y_range=(0, 9)),
        Panel("three", "x, s", "f, Hz", (dashed(1.0, heights[[0, -1]]),), shade, log="y"),
        Panel("four", "x", "y", (), Shade(places, heights, np.abs(value), "q"), even=True),
        Panel("a title that is long enough to need the whole line", "x", "y", (Curve("a label " * 6, x, x),)),
    )
    return Picture(panels, Table(("head", "n"), (("a$", 1.23456), ("b", math.nan))), 2, "found")


def _drawings(patch):
    """Wide, narrow, in one column and in three, and a table."""
    picture = _picture()
    pictures = {"two": picture, "one": replace(picture, columns=1), "three": replace(picture, columns=3)}
    drawn = {name: shown(drawing.draw(one)) for name, one in pictures.items()}
    drawn["three"] = drawn["three"][:4]
    drawn["narrow"] = shown(drawing.draw(picture, narrow=True))
    table = drawing.draw(replace(picture, panels=()))
    drawn_cells = table.axes[0].tables[0].get_celld().items()
    cells = {str(key): [cell.get_text().get_text(), cell.visible_edges] for key, cell in drawn_cells}
    drawn["table"] = [list(table.get_size_inches()), cells]
    long = Curve("long", np.arange(3001.0), np.arange(3001.0) ** 2)
    big = Shade(np.arange(101.0), np.arange(70.0), np.ones((70, 101)), "v")
    wide = as_csv(Picture((Panel("p", "x", "y", (long,), big),))).splitlines()
    return drawn, as_csv(picture).splitlines(), [len(wide), *wide[:3], *wide[1000:1004], wide[-1]]


def _words(patch):
    """Intervals that are accepted, and numbers in words."""
    accept = partial(claim._accepted)
    intervals = [accept(2.0), accept(2.0, percent=10.0), accept("words", percent=10.0), accept(2.0, near=-4.0, by=0.5),
                 accept(2.0, least=1.0), accept((1.0, 2.0), most=3.0), accept(5, percent=20.0, by=1.0)]  # fmt: skip
    named = [claim.named(*one) for one in (("edge_mm", 0.5), ("speed_mm_s", 2), ("snr_dB", "loud"), ("friction", 0.25))]
    # What is allowed beyond a printed value for rounding, in units of 1e-9
    rounding = [round(1e9 * (accept(near)[1] - near), 2) for near in (2.0, 7.0)]
    stems = [one.stem for paper in PAPERS.values() for one in paper.figures]
    counted = [len(claim.read_claims()), [one.key for one in claim.read_claims()][::20]]
    return intervals, named, counted, rounding, stems


PARTS = {
    "meshes": _meshes,
    "elements": _elements,
    "answers": _answers,
    "rows": _rows,
    "compared": _compared,
    "drawings": _drawings,
    "words": _words,
}


@pytest.mark.parametrize("part", PARTS)
def test_it_is_what_it_was(part, monkeypatch):
    assert pinned.same(PARTS[part](monkeypatch), KEPT, part) == []


if __name__ == "__main__":
    pinned.update(PARTS, KEPT, sys.argv[1:])
