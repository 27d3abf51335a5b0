"""The papers with their figures. Each figure is computed once, kept in the cache, drawn, and written with its data and
one page of all."""

import difflib
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import numpy as np

from papilla.core import cache
from papilla.core.errors import InputError
from papilla.core.files import check_writable, replacing_set, write_text
from papilla.core.outside import shipped, toml
from papilla.core.progress import Progress, silent
from papilla.model.finger import Finger
from papilla.telepresence import read_curve
from papilla.verify.jobs import run_jobs
from papilla.view.style import STYLE_SHEET
from papilla_papers.claims.scenes import scenes
from papilla_papers.figures import drawing
from papilla_papers.figures.picture import Figure, Paper, Picture, as_csv


def _paper(title: str, module: str, left_out: Mapping[str, str], figures: Sequence[dict]) -> Paper:
    """A paper whose figures are computed by functions of a module next to this one."""
    functions = import_module(f"{__package__}.{module}")
    drawn = [{**one, "make": getattr(functions, one["make"]), "claims": tuple(one["claims"])} for one in figures]
    return Paper(title, tuple(Figure(**fields) for fields in drawn), left_out)


ALL_PAPERS: dict[str, Paper] = {
    name: _paper(**paper)
    for name, paper in toml(shipped("papilla_papers.figures", "papers.toml"), "papers.toml").items()
}
"""Papers by their names in `papilla reproduce`."""

FIGURES_PAGE = "figures.html"
CACHE_KIND = "figure"
"""Kind of the entries in the cache."""
FIGURE_DESIGNS = ("default", "published", "one-gauge")
"""Fingers of the figures: their content determines whether a kept figure is still valid."""


@dataclass(frozen=True, eq=False)
class Made:
    """A computed figure of a paper (its name in `ALL_PAPERS`): its data, its SVG file, and one for a telephone."""

    paper: str
    figure: Figure
    picture: Picture
    svg: bytes
    narrow_svg: bytes

    @property
    def stem(self) -> str:
        """Start of the names of its files: "2006_fig_5"."""
        return f"{self.paper}_{self.figure.stem}"


def chosen(paper: str, papers: Mapping[str, Paper] = ALL_PAPERS) -> list[str]:
    """The names of a paper, or of all papers for an empty text; raises `InputError` for a name that no paper has."""
    if not paper:
        return list(papers)
    if paper in papers:
        return [paper]
    near = difflib.get_close_matches(paper.lower(), papers, n=1, cutoff=0.4)
    hint = f"; did you mean {near[0]}?" if near else ""
    raise InputError(f"no paper is called {paper!r}: give one of {', '.join(papers)}{hint}")


def figures(
    paper: str = "", *, processes: int = 1, progress: Progress = silent, papers: Mapping[str, Paper] = ALL_PAPERS
) -> list[Made]:
    """Compute the figures of one of the papers, or of all.

    `processes` groups of figures are computed at once; `progress` is called with what is done now, how many groups are
    done, and how many there are. Raises `InputError` for a name that no paper has.
    """
    jobs: dict[str, tuple] = {}
    for name in chosen(paper, papers):
        for figure in papers[name].figures:
            job = f"{name}, {figure.group or figure.name}"
            jobs[job] = (name, (*jobs.get(job, ((), ()))[1], figure))
    groups = run_jobs(_make, jobs, processes=processes, progress=progress)
    by_stem = {drawn.stem: drawn for _, group in groups for drawn in group}
    order = [f"{name}_{figure.stem}" for name in papers for figure in papers[name].figures]
    return [by_stem[stem] for stem in order if stem in by_stem]


def write(
    folder: Path, made: list[Made], seconds: float = 0.0, papers: Mapping[str, Paper] = ALL_PAPERS
) -> dict[str, Path]:
    """Write an SVG and a CSV file a figure, and the page of all; returns their paths by name ("page" is the page's).

    Raises `FileAccessError`.
    """
    check_writable(folder)
    paths = {f"{drawn.stem}.{ending}": folder / f"{drawn.stem}.{ending}" for drawn in made for ending in ("svg", "csv")}
    paths["page"] = folder / FIGURES_PAGE
    with replacing_set(list(paths.values())) as temporary:
        for drawn, picture, data in zip(made, temporary[:-1:2], temporary[1:-1:2], strict=True):
            picture.write_bytes(drawn.svg)
            write_text(data, as_csv(drawn.picture))
        write_text(temporary[-1], _page(made, seconds, papers))
    return paths


def _page(made: Sequence[Made], seconds: float, papers: Mapping[str, Paper]) -> str:
    """The page of figures, one below the other, with differences from print and the claims about them."""
    from papilla import __version__
    from papilla.view.page import either, environment
    from papilla_papers.claims.runner import ALL_CLAIMS

    by_paper = {name: [drawn for drawn in made if drawn.paper == name] for name in papers}
    return (
        environment("papilla_papers.figures")
        .get_template("figures.html")
        .render(
            papers=[
                (papers[name], figures_of_paper) for name, figures_of_paper in by_paper.items() if figures_of_paper
            ],
            claims={claim.key: claim for claim in ALL_CLAIMS},
            pictures={
                drawn.stem: either((drawn.svg, drawn.narrow_svg), drawn.figure.title, "svg+xml") for drawn in made
            },
            seconds=seconds,
            version=__version__,
        )
    )


def _make(paper: str, group: tuple[Figure, ...], progress: Progress) -> list[Made]:
    """The figures of one group."""
    figures_of_group = []
    for figure in group:
        progress(f"{paper}, {figure.name}")
        with warnings.catch_warnings():
            # Two groups may need one section of the finger at once; the progress already says so
            warnings.filterwarnings("ignore", "waiting for another process", RuntimeWarning)
            figures_of_group.append(_kept(paper, figure))
    return figures_of_group


def _kept(paper: str, figure: Figure) -> Made:
    """A figure, from the cache if its code and the designs are unchanged."""
    designs = [Finger.load(name).sha256 for name in FIGURE_DESIGNS]
    key = cache.key(figure.make.__module__, paper, figure.name, designs, read_curve(), scenes())
    packed = cache.fetch(CACHE_KIND, key, lambda: {"picture": figure.make().packed()})["picture"]
    picture = Picture.unpacked(packed)

    def draw() -> dict[str, np.ndarray]:
        files = {name: drawing.as_svg(picture, narrow=name == "narrow") for name in ("svg", "narrow")}
        return {name: np.frombuffer(file, np.uint8) for name, file in files.items()}

    drawn = cache.fetch(CACHE_KIND, cache.key(drawing.__name__, packed, STYLE_SHEET), draw)
    return Made(paper, figure, picture, drawn["svg"].tobytes(), drawn["narrow"].tobytes())
