"""What a drawn figure of matplotlib shows: its words, and what is cut off, overlaps or covers data."""

from itertools import combinations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.text import Text


def texts(figure: Figure) -> list[str]:
    """All texts of a figure."""
    return [item.get_text() for item in figure.findobj(match=Text)]


def words(figure: Figure) -> str:
    """All texts of a figure in one line."""
    return " ".join(" ".join(texts(figure)).split())


def flaws(figure: Figure) -> list[str]:
    """What a reader would stumble over: texts that are cut off by the edge, titles over each other or over axes, axes
    without labels, and legends that cover points of curves."""
    figure.draw_without_rendering()
    figure.draw_without_rendering()
    found, (width, height) = [], figure.bbox.size
    for text in [*figure.texts, *(text for axes in figure.axes if axes.get_visible() for text in _words_of(axes))]:
        box = text.get_window_extent()
        inside = box.x0 >= -2 and box.y0 >= -2 and box.x1 <= width + 2 and box.y1 <= height + 2
        if text.get_text().strip() and text.get_visible() and not inside:
            found.append(f"cut off: {text.get_text()!r}")
    boxes = [(one.get_text(), one.get_window_extent()) for one in figure.texts]
    boxes += [(f"axes {k}", one.get_window_extent()) for k, one in enumerate(figure.axes) if one.get_visible()]
    found += [f"{a!r} over {b!r}" for (a, one), (b, two) in combinations(boxes, 2) if _overlap(one, two)]
    for axes in (axes for axes in figure.axes if axes.get_legend()):
        box = axes.get_legend().get_window_extent()
        for line in axes.lines:
            points = axes.transData.transform(np.column_stack(line.get_data(orig=False)).astype(float))
            if len(points) > 2 and any(box.contains(*point) for point in points if np.isfinite(point).all()):
                found.append(f"the legend covers {line.get_label()!r}")
    return found


def _words_of(axes) -> list[Text]:
    """Texts on axes, their legend and, if they are on, their titles and labels; ticks beyond limits are not drawn."""
    legend = axes.get_legend()
    titles = [item for item in axes.get_children() if isinstance(item, Text)]
    labels = [axes.xaxis.label, axes.yaxis.label] if axes.axison else []
    return [*titles, *labels, *(legend.get_texts() if legend else ())]


def _overlap(one, two) -> bool:
    return min(one.x1, two.x1) - max(one.x0, two.x0) > 1 and min(one.y1, two.y1) - max(one.y0, two.y0) > 1
