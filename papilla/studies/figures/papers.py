"""The papers and their figures, and what of them is not drawn."""

from papilla.studies.figures import paper_2006, paper_2006_softness, paper_2007
from papilla.studies.figures.registry import Paper

PHOTO, DIAGRAM = "a photograph", "a drawing or block diagram without data"

PAPERS: dict[str, Paper] = {
    "2006": Paper(
        "2006: real-time estimation of touch feeling factors",
        (*paper_2006.FIGURES, *paper_2006_softness.FIGURES),
        {"fig. 1": DIAGRAM, "fig. 3": DIAGRAM, "fig. 4": PHOTO},
    ),
    "2007": Paper(
        "2007: roughness feeling telepresence",
        paper_2007.FIGURES,
        {"fig. 1": DIAGRAM, "fig. 2": PHOTO, "fig. 4": DIAGRAM, "figs 6, 7": PHOTO},
    ),
}
"""By the names that `papilla reproduce` has for them."""
