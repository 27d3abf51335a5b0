"""Sphinx extension: formulas as pictures in the page itself, drawn by matplotlib, so that a page needs no network."""

import html
from functools import cache

from docutils import nodes
from matplotlib.path import Path
from matplotlib.textpath import TextPath

SIZE = 10.0
"""Size of the drawn letters; the page scales it to its own, 1 em."""
_LETTERS = {Path.MOVETO: "M", Path.LINETO: "L", Path.CURVE3: "Q", Path.CURVE4: "C", Path.CLOSEPOLY: "Z"}


@cache
def drawn(tex: str) -> str:
    """A formula as an SVG element in the colour of the text around it, on its baseline."""
    path = TextPath((0, 0), f"${tex}$", size=SIZE)
    steps = []
    for points, code in path.iter_segments(curves=True, simplify=False):
        places = "" if code == Path.CLOSEPOLY else " ".join(f"{value:.2f}" for value in points)
        steps.append(_LETTERS[code] + places)
    box = path.get_extents().padded(0.3)
    width, height, depth = (value / SIZE for value in (box.width, box.height, max(-box.y0, 0.0)))
    style = f"width:{width:.3f}em;height:{height:.3f}em;vertical-align:{-depth:.3f}em"
    view = f"{box.x0:.2f} {-box.y1:.2f} {box.width:.2f} {box.height:.2f}"
    return (
        f'<svg class="formula" role="img" aria-label="{html.escape(tex)}" style="{style}" viewBox="{view}">'
        f'<path transform="scale(1,-1)" fill="currentColor" d="{"".join(steps)}"/></svg>'
    )


def inline(self, node: nodes.math) -> None:
    """A formula inside a line."""
    self.body.append(drawn(node.astext()))
    raise nodes.SkipNode


def block(self, node: nodes.math_block) -> None:
    """Formulas of their own, one a line; a blank line in the source separates them."""
    rows = [" ".join(row.split()).replace("frac{", "dfrac{") for row in node.astext().split("\n\n")]
    self.body.append("".join(f'<div class="formula-row">{drawn(row)}</div>' for row in rows))
    raise nodes.SkipNode


def setup(app) -> dict[str, bool]:
    """Register the renderer under the name "drawn"."""
    app.add_html_math_renderer("drawn", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
