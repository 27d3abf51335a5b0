"""Optimal places of gauges: greedy choice and exchange among all places, for the smallest sigma of ln E.

A touch has six unknowns: ln E, ln force, friction, the place in x and y, and creep. A gauge with slopes a (by the
unknowns) and its own variance d (noise, zero, gain, calibration) adds a a' / d to the information matrix M. Sigma of ln
E is the root of (M^-1)_00, and a further gauge reduces (M^-1)_00 by

    (M^-1 a)_0^2 / (d + a' M^-1 a)        (Sherman and Morrison 1950, doi:10.1214/aoms/1177729893):

so all candidates are evaluated at once. The criterion is the mean of sigma squared over the touches of the scene. Foils
must not overlap. On small grids greedy choice and exchange find the same sets as an exhaustive search; on large grids
that has not been tested. `place_gauges` is `papilla design --place N`: it writes the places, the gain by each further
gauge, and a page.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from papilla.core.errors import InputError
from papilla.core.files import check_writable, write_text
from papilla.core.progress import Progress, silent
from papilla.core.tables import write_table
from papilla.design.influence import Influence, influence
from papilla.design.scene import PRIOR_SIGMA_LN_MODULUS, DesignScene
from papilla.design.study import Study
from papilla.estimators.softness.touch import TOUCH_RULES
from papilla.fem.pressing.large_strain import CONTINUED_GAUGE
from papilla.model.finger import Finger
from papilla.view.page import environment, image
from papilla.view.style import ACCENT_COLORS, MUTED_COLOR, mark_gauge, styled

MOST_EXCHANGES = 20
"""Largest number of rounds of exchange; two or three are usual."""
EXCHANGE_STARTS = 14
"""Number of candidates for the next gauge from which exchange starts, spread from the best to the worst: started from
the best alone, it missed the optimum in one of 24 small problems."""
GAUGE_ERROR = 0.004
"""Relative one sigma of a gauge in a calibration: mesh scatter, fit and large strain are 0.3 to 0.4 % of it on the
default finger at 0.2 to 0.98 N."""
FRICTION_SIGMA = 0.5
"""One sigma of friction, relative to the change without friction: two sigmas reach from stick to none."""
MAP_IN = 5.6
"""Height of the picture of the places, inches."""
KNOWN_SIGMA = 1e-9
"""One sigma of an unknown that is known: next to zero, instead of one column less."""
TOUCHING_MM = 1e-6
"""Rounding of the distance of foils that touch, which do not overlap."""
UNKNOWN_SCENES = {
    "friction and place unknown": (True, True),
    "place unknown": (False, True),
    "friction unknown": (True, False),
    "neither": (False, False),
}
"""Quantities of a touch that may be unknown: friction, place. Gauges are placed for the first."""


@dataclass(frozen=True, eq=False)
class PlacementProblem:
    """Candidates of a scene: slopes (p, k, 6), own variances (p, k), information without gauges (p, 6, 6), and overlaps
    of foils (k, k)."""

    slopes: np.ndarray
    variance: np.ndarray
    prior: np.ndarray
    overlap: np.ndarray

    def sigma(self, chosen: list[int]) -> float:
        """Root mean square sigma of ln E with the chosen candidates."""
        return float(np.sqrt(self._inverse(chosen)[:, 0, 0].mean()))

    def better(self, chosen: list[int]) -> np.ndarray:
        """(k,) mean sigma squared with one more candidate; infinite if its foil overlaps a chosen one."""
        inverse = self._inverse(chosen)
        moved = self.slopes @ inverse
        gain = moved[:, :, 0] ** 2 / (self.variance + np.einsum("pki,pki->pk", moved, self.slopes))
        after = (inverse[:, 0, 0][:, None] - gain).mean(axis=0)
        return np.where(self.overlap[chosen].any(axis=0), np.inf, after) if chosen else after

    def _inverse(self, chosen: list[int]) -> np.ndarray:
        slopes = self.slopes[:, chosen]
        information = self.prior + np.einsum("pki,pkj,pk->pij", slopes, slopes, 1 / self.variance[:, chosen])
        return np.linalg.inv(information)


def problem(found: Influence, scene: DesignScene, *, friction: bool = True, place: bool = True) -> PlacementProblem:
    """The problem of a scene; friction, place : whether each is unknown."""
    doubts = scene.unknown.doubts
    by_modulus, by_force, free, x, y = found.slopes
    slopes = np.stack([by_modulus, by_force, free, x, y, found.reading], axis=2)
    # A gain error is proportional to the reading; noise averages over the samples; a zero that was measured in the air
    # is known better than one that was not, but drifts.
    gain = GAUGE_ERROR**2 + CONTINUED_GAUGE**2 + doubts.gauge_gain**2
    zero = (TOUCH_RULES.air_share * doubts.zero_microstrain) ** 2
    variance = gain * found.reading**2 + scene.gauge_noise_microstrain**2 / scene.samples + zero
    offset = (TOUCH_RULES.air_share * doubts.force_offset_N) ** 2 + scene.force_noise_N**2 / scene.samples
    force = doubts.force_gain**2 + offset / found.force_N**2
    place_mm = scene.place_mm * place
    sigmas = np.tile(
        [PRIOR_SIGMA_LN_MODULUS, 0.0, FRICTION_SIGMA * friction, place_mm, place_mm, doubts.creep], (len(force), 1)
    )
    sigmas[:, 1] = np.sqrt(force)
    prior = np.einsum("pi,ij->pij", 1 / np.maximum(sigmas, KNOWN_SIGMA) ** 2, np.eye(sigmas.shape[1]))
    apart = np.linalg.norm(found.sites[:, None] - found.sites, axis=2)
    return PlacementProblem(slopes, variance, prior, apart < found.gauges[0].backing_mm[0] - TOUCHING_MM)


def place(posed: PlacementProblem, count: int, among: np.ndarray | None = None) -> list[list[int]]:
    """The chosen candidates for 1 to `count` gauges, or as many as fit. among : (k,) allowed candidates."""
    allowed = np.ones(posed.overlap.shape[0], bool) if among is None else among
    chosen: list[int] = []
    sets = []
    for _ in range(count):
        after = np.where(allowed, posed.better(chosen), np.inf)
        if not np.isfinite(after).any():
            break
        starts = [
            k for k in after.argsort(kind="stable")[:: max(1, len(after) // EXCHANGE_STARTS)] if np.isfinite(after[k])
        ]
        tried = [exchanged(posed, [*chosen, int(k)], allowed) for k in starts]
        chosen = min(tried, key=posed.sigma)
        sets.append(sorted(chosen))
    return sets


def exchanged(posed: PlacementProblem, chosen: list[int], allowed: np.ndarray) -> list[int]:
    """A choice after every gauge in turn was moved to its best place, until none moves."""
    for _ in range(MOST_EXCHANGES):
        before = list(chosen)
        for k in range(len(chosen)):
            others = chosen[:k] + chosen[k + 1 :]
            after = np.where(allowed, posed.better(others), np.inf)
            best = int(after.argmin())
            if after[best] < after[chosen[k]] * (1 - 1e-12):
                chosen = [*chosen[:k], best, *chosen[k + 1 :]]
        if chosen == before:
            break
    return chosen


@dataclass(frozen=True, eq=False)
class Placed:
    """Gauges placed for unknown friction and place, anywhere and in a row at y = 0.

    sets, rows : chosen candidates of `found` for 1, 2, ... gauges. sigma : kind of places -> unknown quantities -> rms
    sigma of ln E by number of gauges.
    """

    finger: Finger
    found: Influence
    sets: list[list[int]]
    rows: list[list[int]]
    sigma: dict[str, dict[str, list[float]]]
    written: list[str]

    def of(self, chosen: list[int]) -> Finger:
        """The finger with the chosen gauges, in the order of x."""
        order = sorted(chosen, key=lambda k: (self.found.sites[k][0], self.found.sites[k][1]))
        gauges = tuple(replace(self.found.gauges[k], name=f"g{n}") for n, k in enumerate(order, start=1))
        return replace(self.finger, gauges=gauges, identified=None)

    @property
    def sentences(self) -> list[str]:
        """The results of the placement, as sentences."""
        both, *easier = UNKNOWN_SCENES
        anywhere, in_row = self.sigma["anywhere"], self.sigma["in a row"][both]
        best = anywhere[both]
        most = min(len(best), len(in_row))
        return [
            f"{len(best)} gauges anywhere give sigma {best[-1]:.3g} of ln E (rms over the scene), one {best[0]:.3g}",
            f"{most} gauges anywhere leave {best[most - 1]:.3g}, {most} in a row at y = 0 leave {in_row[most - 1]:.3g}",
            *(f"the same {len(best)} gauges with {name}: {anywhere[name][-1]:.3g}" for name in easier),
        ]


def place_gauges(study: Study, count: int, out: Path, progress: Progress = silent) -> Placed:
    """Place 1 to `count` gauges on the study's finger, with its fixed values, in its scene; write placement.csv,
    placement.html and placed_N.toml. Raises `InputError` for parameters of gauges' places among the fixed ones."""
    placing = ("gauges.g", "gauges.count", "gauges.spread")
    if bad := next((name for name in study.fixed if name.startswith(placing)), None):
        raise InputError(f"--place decides where gauges sit: {bad} cannot be fixed")
    check_writable(out)
    middle = {name: value for name, value in study.middle.items() if not name.startswith("gauges.")}
    finger = study.finger_of(middle)
    candidates = influence(finger, study.scene, progress)
    in_row = np.array([gauge.y_mm == 0 and gauge.direction_deg == 0 for gauge in candidates.gauges])
    progress("choosing places")
    unknown = {name: problem(candidates, study.scene, friction=f, place=p) for name, (f, p) in UNKNOWN_SCENES.items()}
    hardest = next(iter(unknown.values()))
    sets, rows = place(hardest, count), place(hardest, count, in_row)
    sigma = {
        layout: {name: [posed.sigma(chosen) for chosen in some] for name, posed in unknown.items()}
        for layout, some in (("anywhere", sets), ("in a row", rows))
    }
    files = [out / "placement.csv", out / "placement.html", out / f"placed_{len(sets)}.toml"]
    placed = Placed(finger, candidates, sets, rows, sigma, list(map(str, files)))
    columns: dict[str, list] = {"gauges": list(range(1, len(sets) + 1))}
    for layout, by in sigma.items():
        columns |= {f"{layout}, {name}": [*v, *[float("nan")] * (len(sets) - len(v))] for name, v in by.items()}
    write_table(files[0], columns)
    best = placed.of(sets[-1])
    page = environment("papilla.design").get_template("placement.html")
    pictures = {
        "sigma": image(sigma_figure(placed), "Sigma of ln E against the number of gauges"),
        "places": image(places_figure(placed), "The chosen gauges from above"),
    }
    write_text(files[1], page.render(placed=placed, study=study, figures=pictures, best=best.gauges))
    best.save(files[2])
    return placed


def sigma_figure(placed: Placed) -> Figure:
    """Sigma of ln E against the number of gauges, anywhere and in a row."""
    with styled() as figure:
        axes = figure.subplots()
        for color, name in zip(ACCENT_COLORS, UNKNOWN_SCENES, strict=False):
            for layout, style, label in (("anywhere", "o-", name), ("in a row", "o--", None)):
                values = placed.sigma[layout][name]
                axes.plot(range(1, len(values) + 1), values, style, color=color, label=label)
        axes.plot([], [], "--", color=MUTED_COLOR, label="in a row at y = 0")
        axes.set(xlabel="gauges", ylabel="sigma of ln E (rms over the scene)", ylim=(0, None))
        axes.set_xticks(range(1, len(placed.sets) + 1))
        axes.legend()
    return figure


def places_figure(placed: Placed) -> Figure:
    """The chosen gauges from above, in the plane of x and y."""
    with styled(height=MAP_IN) as figure:
        axes = figure.subplots()
        axes.plot(*placed.found.sites[:, :2].T, ",", color=MUTED_COLOR)
        for k in placed.sets[-1]:
            gauge, site = placed.found.gauges[k], placed.found.sites[k, :2]
            half = gauge.length_mm / 2 * np.array([1.0, 0.0] if gauge.direction_deg == 0 else [0.0, 1.0])
            mark_gauge(axes, np.array([site - half, site + half]))
        axes.set(xlabel="x (mm), across the finger", ylabel="y (mm), along the finger", aspect="equal")
    return figure
