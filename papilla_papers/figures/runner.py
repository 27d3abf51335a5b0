"""The papers with their figures. Each figure is computed once, kept in the cache, drawn, and written with its data and
one page of all."""

import difflib
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from papilla.core import cache
from papilla.core.errors import InputError
from papilla.core.files import check_writable, replacing_set, write_text
from papilla.core.progress import Progress, silent
from papilla.model.finger import Finger
from papilla.telepresence import read_curve
from papilla.verify.jobs import run_jobs
from papilla.view.style import STYLE_SHEET
from papilla_papers.claims.scenes import scenes
from papilla_papers.figures import drawing, paper_2006, paper_2007, paper_oddo, paper_okamoto, paper_textiles
from papilla_papers.figures.picture import Figure, Paper, Picture, as_csv

PHOTO, DIAGRAM = "a photograph", "a drawing or block diagram without data"

PAPERS: dict[str, Paper] = {
    "2006": Paper(
        "2006: real-time estimation of touch feeling factors",
        paper_2006.FIGURES,
        {"fig. 1": DIAGRAM, "fig. 3": DIAGRAM, "fig. 4": PHOTO},
    ),
    "2007": Paper(
        "2007: roughness feeling telepresence",
        paper_2007.FIGURES,
        {"fig. 1": DIAGRAM, "fig. 2": PHOTO, "fig. 4": DIAGRAM, "figs 6, 7": PHOTO},
    ),
    "2011_okamoto": Paper(
        "2011: remote tactile transmission with time delay",
        paper_okamoto.FIGURES,
        {
            "figs 1, 2, 6, 12, 13": DIAGRAM,
            "figs 3, 4, 5, 7, 8, 14": PHOTO,
            "figs 15, 16, tables 1-4": "answers of people",
        },
    ),
    "2011_oddo": Paper(
        "2011: roughness encoding in artificial active touch",
        paper_oddo.FIGURES,
        {"fig. 1": PHOTO, "the micrographs of fig. 9": PHOTO},
    ),
    "textiles": Paper(
        "Tactile design of manipulator fingers: fingertip and textile vibration",
        paper_textiles.FIGURES,
        {"fig. 1": PHOTO, "fig. 2 (a)": DIAGRAM},
    ),
}
"""Papers by their names in `papilla reproduce`."""

PAGE = "figures.html"
KIND = "figure"
"""Kind of the entries in the cache."""
DESIGNS = ("default", "published", "one-gauge")
"""Fingers of the figures: their content determines whether a kept figure is still valid."""


@dataclass(frozen=True, eq=False)
class Made:
    """A computed figure of a paper (its name in `PAPERS`): its data, its SVG file, and one for a telephone."""

    paper: str
    figure: Figure
    picture: Picture
    svg: bytes
    narrow_svg: bytes

    @property
    def stem(self) -> str:
        """Start of the names of its files: "2006_fig_5"."""
        return f"{self.paper}_{self.figure.stem}"


def chosen(paper: str, papers: Mapping[str, Paper] = PAPERS) -> list[str]:
    """The names of a paper, or of all papers for an empty text; raises `InputError` for a name that no paper has."""
    if not paper:
        return list(papers)
    if paper in papers:
        return [paper]
    near = difflib.get_close_matches(paper.lower(), papers, n=1, cutoff=0.4)
    hint = f"; did you mean {near[0]}?" if near else ""
    raise InputError(f"no paper is called {paper!r}: give one of {', '.join(papers)}{hint}")


def figures(
    paper: str = "", *, processes: int = 1, progress: Progress = silent, papers: Mapping[str, Paper] = PAPERS
) -> list[Made]:
    """Compute the figures of one of the papers, or of all.

    `processes` groups of figures are computed at once; `progress` is called with what is done now, how many groups are
    done, and how many there are. Raises `InputError` for a name that no paper has.
    """
    jobs: dict[str, tuple] = {}
    for name in chosen(paper, papers):
        for one in papers[name].figures:
            job = f"{name}, {one.group or one.name}"
            jobs[job] = (name, (*jobs.get(job, ((), ()))[1], one))
    made = {
        one.stem: one for _, group in run_jobs(_make, jobs, processes=processes, progress=progress) for one in group
    }
    order = [f"{name}_{one.stem}" for name in papers for one in papers[name].figures]
    return [made[stem] for stem in order if stem in made]


def write(
    folder: Path, made: list[Made], seconds: float = 0.0, papers: Mapping[str, Paper] = PAPERS
) -> dict[str, Path]:
    """Write an SVG and a CSV file a figure, and the page of all; returns their paths by name ("page" is the page's).

    Raises `FileAccessError`.
    """
    check_writable(folder)
    paths = {f"{one.stem}.{kind}": folder / f"{one.stem}.{kind}" for one in made for kind in ("svg", "csv")}
    paths["page"] = folder / PAGE
    with replacing_set(list(paths.values())) as temporary:
        for one, picture, data in zip(made, temporary[:-1:2], temporary[1:-1:2], strict=True):
            picture.write_bytes(one.svg)
            write_text(data, as_csv(one.picture))
        write_text(temporary[-1], _page(made, seconds, papers))
    return paths


def _page(made: Sequence[Made], seconds: float, papers: Mapping[str, Paper]) -> str:
    """The page of figures, one below the other, with differences from print and the claims about them."""
    from papilla import __version__
    from papilla.view.page import either, environment
    from papilla_papers.claims.runner import ALL_CLAIMS

    by_paper = {name: [one for one in made if one.paper == name] for name in papers}
    return (
        environment("papilla_papers.figures")
        .get_template("figures.html")
        .render(
            papers=[(papers[name], own) for name, own in by_paper.items() if own],
            claims={claim.key: claim for claim in ALL_CLAIMS},
            pictures={one.stem: either((one.svg, one.narrow_svg), one.figure.title, "svg+xml") for one in made},
            seconds=seconds,
            version=__version__,
        )
    )


def _make(paper: str, group: tuple[Figure, ...], progress: Progress) -> list[Made]:
    """The figures of one group."""
    made = []
    for figure in group:
        progress(f"{paper}, {figure.name}")
        with warnings.catch_warnings():
            # Two groups may need one section of the finger at once; the progress already says so
            warnings.filterwarnings("ignore", "waiting for another process", RuntimeWarning)
            made.append(_kept(paper, figure))
    return made


def _kept(paper: str, figure: Figure) -> Made:
    """A figure, from the cache if its code and the designs are unchanged."""
    designs = [Finger.load(name).sha256 for name in DESIGNS]
    key = cache.key(figure.make.__module__, paper, figure.name, designs, read_curve(), scenes())
    packed = cache.fetch(KIND, key, lambda: {"picture": figure.make().packed()})["picture"]
    picture = Picture.unpacked(packed)

    def draw() -> dict[str, np.ndarray]:
        files = {name: drawing.as_svg(picture, narrow=name == "narrow") for name in ("svg", "narrow")}
        return {name: np.frombuffer(file, np.uint8) for name, file in files.items()}

    drawn = cache.fetch(KIND, cache.key(drawing.__name__, packed, STYLE_SHEET), draw)
    return Made(paper, figure, picture, drawn["svg"].tobytes(), drawn["narrow"].tobytes())
