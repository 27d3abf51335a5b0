"""Common style of all pictures and plots, and writing of figures to files, with matplotlib's object interface only."""

import io
import textwrap
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, NullLocator

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.files import replacing
from papilla.core.outside import shipped
from papilla.model.specimen import friction_words

_SHEET = Path(__file__).parents[1] / "data" / "papilla.mplstyle"
STYLE_SHEET = shipped("papilla", "data", _SHEET.name)
"""The style sheet of all pictures, for the keys of pictures in the cache."""
_STYLE = matplotlib.rc_params_from_file(_SHEET, use_default_template=False)
INK_COLOR, MUTED_COLOR, FAINT_COLOR = (_STYLE[key] for key in ("text.color", "xtick.color", "grid.color"))
"""Colours of text, of secondary text, and of grids and frames."""
THIN_PT, THICK_PT = 0.8, 1.7
"""Widths in points of a line that helps to read (a frame, an edge, zero), and of the curve that a picture is about;
other curves have the width of the style sheet."""
GAUGE_COLOR, GAUGE_PT, EDGE_PT = "#f5c400", 4, 6.5
"""Colour of a gauge's grid; width of its line and of the line behind it, in points."""
RIGID_COLOR = "#c9ced6"
"""Colour of a rigid bone, and of a texture."""
MICROSTRAIN_A_THOUSAND = 1000
"""Microstrain of a unit of 10³ µε."""

ACCENT_COLORS = ("#0b5fa5", "#c2410c", "#2f855a", "#7c3aed", "#b7791f", "#0e7490", "#be185d", "#475569")
"""Colours of curves, in order."""

DIVERGING_COLORS = "RdBu_r"  # For signed quantities, always centred at zero: red is tension
SEQUENTIAL_COLORS = "Blues"  # For quantities that start at zero

STRAIN_QUANTITY, STRESS_COMPONENTS = "strain", ("xx", "yy", "zz", "xy", "yz", "xz", "mises")
"""What a strain picture shows: strain along the layers, or a component of the stress; "mises" is that of von Mises."""

PLOT_WIDTH_IN, PLOT_HEIGHT_IN = 7.2, 4.4
"""Inches of a plot on a page."""
TITLE_PT, LARGE_PT, PLOT_DPI = 12, 14, 150
"""Sizes of the message above a plot and above a rendered picture; dots of an inch."""
NARROW_IN = 4.6
"""Inches of a figure on a telephone: 10 points are then 10.6 pixels in a column of 350."""
MARGIN_IN, INCH_PER_POINT = 0.12, 1 / 72
"""Margin of the texts at the top of a figure; the size of letters is in points."""
LETTER_WIDTH, LINE_DISTANCE, DETAIL_SIZE = 0.6, 1.4, 0.75
"""Width of a letter on average, and distance of lines, over the size of letters; size of a detail over that of its
message."""

PICTURE_NAME_LETTERS = 24
"""Most letters of a name in a picture."""

_UNDATED: dict[str, dict[str, None]] = {
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    "svg": {"Date": None, "Creator": None},
}
"""The metadata (time, program) to leave out, for each kind of file."""


@contextmanager
def styled(width: float = PLOT_WIDTH_IN, height: float = PLOT_HEIGHT_IN) -> Iterator[Figure]:
    """A new figure of `width` x `height` inches, to be drawn on inside the block, in papilla's style."""
    with matplotlib.rc_context(_STYLE):
        yield Figure(figsize=(width, height))


def named(name: str) -> str:
    """A name as it is shown in a picture: at most `PICTURE_NAME_LETTERS` of it, which leave room for the picture, and a
    space before "_", because matplotlib leaves labels that begin with it out of a legend."""
    short = name if len(name) <= PICTURE_NAME_LETTERS else f"{name[: PICTURE_NAME_LETTERS - 1]}…"
    return f" {short}" if short.startswith("_") else short


def in_a_row(names: Sequence[str]) -> int:
    """Number of columns of a legend: all names in a row, or one below the other if they are long."""
    return len(names) if sum(map(len, names)) <= PICTURE_NAME_LETTERS else 1


def with_formula(*texts: Text) -> None:
    """Let a formula between dollar signs, such as $S_d$, be drawn as one in papilla's own texts; in no others."""
    for text in texts:
        text.set_parse_math(True)


def friction_text(coefficient: float) -> str:
    """A press's friction in a title: "friction 0.5", "friction stick"."""
    words = friction_words(coefficient)
    return f"friction {words}" if isinstance(words, str) else f"friction {words:g}"


def plain_log(axis, steps: Sequence[float] = (1.0, 2.0, 5.0)) -> None:
    """Plain numbers at these steps of each decade of a logarithmic axis."""
    axis.set(major_locator=LogLocator(subs=steps), major_formatter=FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set(minor_locator=NullLocator(), minor_formatter=NullFormatter())


def titled(figure: Figure, message: str, detail: str, size: float = TITLE_PT, *, formula: bool = False) -> None:
    """A bold message of `size` points at the top left of the figure, and below it the detail in smaller grey text; the
    axes get the rest.

    formula : the message is papilla's own and has a formula between dollar signs.
    """
    figure.text(0, 1, message, fontsize=size, weight="bold", va="top", parse_math=formula)
    if detail:
        figure.text(0, 1, detail, fontsize=DETAIL_SIZE * size, color=MUTED_COLOR, va="top")
    _stack(figure)


def narrow(figure: Figure) -> None:
    """Make a figure `NARROW_IN` wide. Letters keep their size, axes become narrower, and there are more lines of text
    above them."""
    wide, tall = figure.get_size_inches()
    before = _stack(figure)
    figure.set_figwidth(NARROW_IN)
    figure.set_figheight(tall + _stack(figure) - before)
    _stack(figure)


def _stack(figure: Figure) -> float:
    """Place the texts of a figure below each other at its top, broken to its width; constrained layout has the room
    below. Returns the inches that they need."""
    (wide, tall), top = figure.get_size_inches(), MARGIN_IN
    for text in figure.texts:
        size = float(text.get_fontsize()) * INCH_PER_POINT
        letters = int((wide - 2 * MARGIN_IN) / (LETTER_WIDTH * size))
        lines = textwrap.wrap(text.get_text(), letters)
        text.set(text="\n".join(lines), position=(MARGIN_IN / wide, 1 - top / tall))
        top += LINE_DISTANCE * size * len(lines)
    layout: Any = figure.get_layout_engine()
    layout.set(rect=(0, 0, 1, 1 - top / tall))
    return top


def color_bar(shades: Any, axes: Any, label: str, **more) -> Colorbar:
    """A bar of the colours of `shades` next to axes, which give it room; its label may have a formula."""
    panels = np.atleast_1d(axes).flat
    bar = panels[0].figure.colorbar(shades, ax=list(panels), label=label, **more)
    with_formula(bar.ax.xaxis.label, bar.ax.yaxis.label)
    bar.outline.set_visible(False)
    return bar


def diverging_bar(axes: Any, limit: float, label: str) -> Colorbar:
    """A bar of signed values to +-`limit` below axes."""
    shades = ScalarMappable(Normalize(-limit, limit), colormaps[DIVERGING_COLORS])
    ticks = np.linspace(-limit, limit, 5)
    return color_bar(shades, axes, label, location="bottom", shrink=0.5, aspect=30, ticks=ticks)


def signed_shades(limit: float) -> dict[str, Any]:
    """How signed values to +-`limit` are drawn on triangles, in the colours of `diverging_bar`."""
    return {"shading": "gouraud", "cmap": DIVERGING_COLORS, "vmin": -limit, "vmax": limit}


def mark_gauge(axes: Axes, ends: np.ndarray, color: str = GAUGE_COLOR, edge: str = INK_COLOR) -> None:
    """The grid of a gauge between its ends (2, 2)."""
    axes.plot(*ends.T, color=edge, linewidth=EDGE_PT, solid_capstyle="butt")
    axes.plot(*ends.T, color=color, linewidth=GAUGE_PT, solid_capstyle="butt")


def kind_of(path: str | Path) -> str:
    """The kind of picture given by a file name's ending; raises `InputError` for an unknown one."""
    suffix = Path(path).suffix.lower().removeprefix(".")
    if suffix not in _UNDATED:
        raise InputError(
            f"{path}: pictures are written as .{', .'.join(_UNDATED)}, not as {suffix or 'a name without'}"
        )
    return suffix


def content(figure: Figure, picture_format: str, dpi: int = PLOT_DPI) -> bytes:
    """The figure as the bytes of a png, pdf or svg file; equal figures give equal bytes."""
    stream = io.BytesIO()
    with matplotlib.rc_context(_STYLE), warnings.catch_warnings():
        # A letter that no font has is drawn as a box
        warnings.filterwarnings("ignore", "Glyph .* missing from font", UserWarning)
        figure.draw_without_rendering()  # The layout of axes of a fixed aspect needs a second pass
        # It imports the canvas of the kind when a picture of this kind is written
        FigureCanvasAgg(figure).print_figure(stream, format=picture_format, dpi=dpi, metadata=_UNDATED[picture_format])
    return stream.getvalue()


def png(figure: Figure, dpi: int = PLOT_DPI) -> bytes:
    """The figure as PNG bytes."""
    return content(figure, "png", dpi)


def svg(figure: Figure) -> bytes:
    """The figure as SVG bytes."""
    return content(figure, "svg")


def write_png(figure: Figure, path: str | Path) -> None:
    """Write the figure as PNG atomically; raises `FileAccessError`."""
    write_bytes(path, png(figure))


def write_bytes(path: str | Path, picture: bytes) -> None:
    """Write a picture's bytes atomically; raises `FileAccessError`."""
    with replacing(path) as temporary:
        temporary.write_bytes(picture)


def nice_limit(value: float) -> float:
    """The smallest of 1, 1.5, 2, 3, 4, 5, 6, 8 x 10^k that is at least `value` > 0: a round end for a colour bar."""
    power = 10.0 ** int(f"{value:e}".split("e")[1])
    return next(
        step * power for step in (1, 1.5, 2, 3, 4, 5, 6, 8, 10) if step * power >= value * (1 - checks.ROUNDING_SHARE)
    )
