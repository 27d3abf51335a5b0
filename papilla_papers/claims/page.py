"""reproduce.html: the table of claims on one self-contained page."""

from collections.abc import Sequence
from os import PathLike

from papilla import __version__
from papilla.core.files import write_text
from papilla.view.page import environment
from papilla_papers.claims.claim import accepted, beside, number, published
from papilla_papers.claims.runner import Result, by_evidence, head


def write_page(path: str | PathLike, results: Sequence[Result], seconds: float) -> None:
    """Write the page, whole or not at all; raises `FileAccessError`. seconds : that the experiments took."""
    templates = environment("papilla_papers.claims")
    templates.filters |= {"number": number, "published": published, "accepted": accepted, "beside": beside}
    answers = [answer for result in results for answer in result.answers]
    text = templates.get_template("reproduce.html").render(
        results=results, head=head(answers), evidence=by_evidence(answers), seconds=seconds, version=__version__
    )
    write_text(path, text)
