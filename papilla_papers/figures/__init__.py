"""`papilla figures`: the figures and tables of the papers, computed, with the printed values as points.

>>> made = papilla_papers.figures.figures("2006")
>>> papilla_papers.figures.write(Path("figures"), made)
"""

from papilla_papers.figures.picture import Curve, Figure, Panel, Paper, Picture, PrintedTable, Shade
from papilla_papers.figures.runner import ALL_PAPERS, Made, figures, write

__all__ = [
    "ALL_PAPERS", "Curve", "Figure", "Made", "Panel", "Paper", "Picture", "PrintedTable", "Shade", "figures", "write",
]  # fmt: skip
