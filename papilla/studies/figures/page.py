"""figures.html: the figures of the papers, one below the other, with differences from print and the claims about
them."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from papilla import __version__
from papilla.studies.figures.papers import PAPERS
from papilla.studies.reproduce.runner import CLAIMS
from papilla.view.page import either, environment

if TYPE_CHECKING:
    from papilla.studies.figures.runner import Made


def page(made: "Sequence[Made]", seconds: float) -> str:
    """The page as HTML. seconds : computing time of the figures."""
    claims = {claim.key: claim for claim in CLAIMS}
    by_paper = {name: [one for one in made if one.paper == name] for name in PAPERS}
    return (
        environment("papilla.studies.figures")
        .get_template("figures.html")
        .render(
            papers=[(PAPERS[name], own) for name, own in by_paper.items() if own],
            claims=claims,
            pictures={one.stem: either((one.svg, one.narrow_svg), one.figure.title, "svg+xml") for one in made},
            seconds=seconds,
            version=__version__,
        )
    )
