"""The look that all pictures and plots share, and how a figure becomes a file: matplotlib's object interface only."""

import io
from collections.abc import Iterator
from contextlib import contextmanager

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from papilla.files import replacing

INK, MUTED, FAINT = "#1d2330", "#5b6472", "#d5dae1"
"""Colours of text, of secondary text, and of grids and frames."""

GAUGE_COLOR = "#f5c400"

ACCENTS = ("#0b5fa5", "#c2410c", "#2f855a", "#7c3aed", "#b7791f", "#0e7490", "#be185d", "#475569")
"""Colours of curves, in order."""

DIVERGING = "RdBu_r"
"""For signed quantities, always centred at zero: red is tension."""

SEQUENTIAL = "Blues"
"""For quantities that start at zero."""

_STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.8,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "axes.grid": True,
    "grid.color": FAINT,
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "figure.facecolor": "white",
    "svg.fonttype": "path",
    "svg.hashsalt": "papilla",
    "hatch.linewidth": 0.6,
    "hatch.color": MUTED,
}


@contextmanager
def styled(width: float, height: float) -> Iterator[Figure]:
    """A new figure of `width` x `height` inches, to be drawn on inside the block, in papilla's style."""
    with matplotlib.rc_context(_STYLE):
        yield Figure(figsize=(width, height))


def png(figure: Figure, dpi: int = 150) -> bytes:
    """The figure as PNG bytes."""
    stream = io.BytesIO()
    FigureCanvasAgg(figure).print_figure(stream, format="png", dpi=dpi, metadata={"Software": None})
    return stream.getvalue()


def svg(figure: Figure) -> bytes:
    """The figure as SVG bytes, the same for the same figure."""
    stream = io.BytesIO()
    with matplotlib.rc_context(_STYLE):
        FigureCanvasSVG(figure).print_figure(stream, format="svg", metadata={"Date": None, "Creator": None})
    return stream.getvalue()


def write_png(figure: Figure, path, dpi: int = 150) -> None:
    """Write the figure atomically; raises `FileAccessError`."""
    content = png(figure, dpi)
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def nice_limit(value: float) -> float:
    """The smallest of 1, 1.5, 2, 3, 4, 5, 6, 8 x 10^k that is at least `value` > 0: a round end for a colour bar."""
    power = 10.0 ** int(f"{value:e}".split("e")[1])
    return next(step * power for step in (1, 1.5, 2, 3, 4, 5, 6, 8, 10) if step * power >= value * (1 - 1e-9))
