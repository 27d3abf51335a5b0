"""`papilla design --place N` as a function: places of gauges, the gain by each further one, and a page."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from papilla.design.influence import Influence, influence
from papilla.design.placement import place, problem
from papilla.design.study import Study
from papilla.errors import InputError
from papilla.files import check_writable, write_text
from papilla.finger import Finger
from papilla.tables import write_table
from papilla.view.page import environment, image
from papilla.view.style import ACCENTS, GAUGE_COLOR, INK, MUTED, styled

UNKNOWN = {
    "friction and place unknown": (True, True),
    "place unknown": (False, True),
    "friction unknown": (True, False),
    "neither": (False, False),
}
"""Quantities of a touch that may be unknown: friction, place."""


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
        both = "friction and place unknown"
        best, row = self.sigma["anywhere"][both], self.sigma["in a row"][both]
        said = [
            f"{len(best)} gauges anywhere give sigma {best[-1]:.3g} of ln E (rms over the scene), one {best[0]:.3g}"
        ]
        most = min(len(best), len(row))
        said.append(
            f"{most} gauges anywhere leave {best[most - 1]:.3g}, {most} in a row at y = 0 leave {row[most - 1]:.3g}"
        )
        known = self.sigma["anywhere"]
        said += [f"the same {len(best)} gauges with {name}: {known[name][-1]:.3g}" for name in list(UNKNOWN)[1:]]
        return said


def place_gauges(study: Study, count: int, out: Path, say: Callable[[str], None] = lambda line: None) -> Placed:
    """Place 1 to `count` gauges on the study's finger, with its fixed values, in its scene; write placement.csv,
    placement.html and placed_N.toml. Raises `InputError` for parameters of gauges' places among the fixed ones."""
    if bad := next(
        (name for name in study.fixed if name.startswith(("gauges.g", "gauges.count", "gauges.spread"))), None
    ):
        raise InputError(f"--place decides where gauges sit: {bad} cannot be fixed")
    check_writable(out)
    finger = study.finger_of({one.name: one.at(0.5) for one in study.free if not one.name.startswith("gauges.")})
    found = influence(finger, study.scene, say)
    row = np.array([one.y_mm == 0 and one.direction_deg == 0 for one in found.gauges])
    say("choosing places")
    unknown = {name: problem(found, study.scene, friction=f, place=p) for name, (f, p) in UNKNOWN.items()}
    hardest = unknown["friction and place unknown"]
    sets, rows = place(hardest, count), place(hardest, count, row)
    sigma = {
        kind: {name: [one.sigma(chosen) for chosen in some] for name, one in unknown.items()}
        for kind, some in (("anywhere", sets), ("in a row", rows))
    }
    files = [out / "placement.csv", out / "placement.html", out / f"placed_{len(sets)}.toml"]
    placed = Placed(finger, found, sets, rows, sigma, list(map(str, files)))
    columns: dict[str, list] = {"gauges": list(range(1, len(sets) + 1))}
    for kind, by in sigma.items():
        columns |= {f"{kind}, {name}": [*v, *[float("nan")] * (len(sets) - len(v))] for name, v in by.items()}
    write_table(files[0], columns)
    page = environment("papilla.design").get_template("placement.html")
    pictures = {
        "sigma": image(sigma_figure(placed), "Sigma of ln E against the number of gauges"),
        "places": image(places_figure(placed), "The chosen gauges from above"),
    }
    write_text(files[1], page.render(placed=placed, study=study, figures=pictures, best=placed.of(sets[-1]).gauges))
    placed.of(sets[-1]).save(files[2])
    return placed


def sigma_figure(placed: Placed) -> Figure:
    """Sigma of ln E against the number of gauges, anywhere and in a row."""
    with styled(7.2, 4.2) as figure:
        axes = figure.add_axes((0.11, 0.14, 0.84, 0.8))
        for color, name in zip(ACCENTS, UNKNOWN, strict=False):
            for kind, style in (("anywhere", "o-"), ("in a row", "o--")):
                values = placed.sigma[kind][name]
                label = name if kind == "anywhere" else None
                axes.plot(range(1, len(values) + 1), values, style, color=color, markersize=4, label=label)
        axes.plot([], [], "--", color=MUTED, label="in a row at y = 0")
        axes.set(xlabel="gauges", ylabel="sigma of ln E (rms over the scene)", ylim=(0, None))
        axes.set_xticks(range(1, len(placed.sets) + 1))
        axes.legend(fontsize=8.5)
    return figure


def places_figure(placed: Placed) -> Figure:
    """The chosen gauges from above, in the plane of x and y."""
    with styled(7.2, 5.6) as figure:
        axes = figure.add_axes((0.14, 0.12, 0.82, 0.82))
        every, chosen = placed.found.sites, placed.sets[-1]
        axes.plot(*every[:, :2].T, ".", color=MUTED, markersize=1.5)
        for k in chosen:
            gauge, (x, y, _) = placed.found.gauges[k], every[k]
            half = gauge.length_mm / 2
            dx, dy = (half, 0.0) if gauge.direction_deg == 0 else (0.0, half)
            axes.plot([x - dx, x + dx], [y - dy, y + dy], color=INK, linewidth=6, solid_capstyle="butt")
            axes.plot([x - dx, x + dx], [y - dy, y + dy], color=GAUGE_COLOR, linewidth=4, solid_capstyle="butt")
        axes.set(xlabel="x (mm), across the finger", ylabel="y (mm), along the finger", aspect="equal")
    return figure
