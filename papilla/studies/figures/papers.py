"""The papers and their figures, and the figures that are not drawn."""

from papilla.studies.figures import paper_2006, paper_2007, paper_oddo, paper_okamoto, paper_textiles
from papilla.studies.figures.picture import Paper

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
