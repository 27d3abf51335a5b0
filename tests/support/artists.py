"""What a figure of matplotlib shows, in words: its axes and artists with their data, colours and widths.

Places that the layout chooses are left out, because they depend on fonts; positions in data coordinates are not.
"""

import numpy as np
from matplotlib.artist import Artist
from matplotlib.collections import Collection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Annotation, Text


def shown(figure: Figure) -> list[str]:
    """A line of words for the figure, for each of its axes, and for each artist."""
    lines = [f"figure {numbers(figure.get_size_inches())}"]
    lines += [_told(one) for one in (*figure.texts, *figure.legends)]
    return lines + [line for axes in figure.axes for line in shown_axes(axes)]


def shown_axes(axes) -> list[str]:
    """A line of words for axes, and for each of their artists."""
    grid = axes.get_gridspec()
    ratios = "" if grid is None else f" of {numbers(grid.get_height_ratios())} x {numbers(grid.get_width_ratios())}"
    lines = [
        f"axes{ratios} x {axes.get_xscale()} {numbers(axes.get_xlim())} {axes.get_xlabel()!r}, "
        f"y {axes.get_yscale()} {numbers(axes.get_ylim())} {axes.get_ylabel()!r}, aspect {axes.get_aspect()}, "
        f"on {axes.axison}, visible {axes.get_visible()}, "
        f"grid {_grid(axes.xaxis)} {_grid(axes.yaxis)}, "
        f"frame {' '.join(name for name, spine in axes.spines.items() if spine.get_visible())}, "
        f"names {axes.xaxis.get_tick_params().get('labelbottom', True)}"
    ]
    frame = {id(one) for one in (*axes.spines.values(), axes.xaxis, axes.yaxis, axes.patch)}
    lines += [_told(one) for one in axes.get_children() if id(one) not in frame]
    return [line for line in lines if line]


def numbers(values) -> str:
    """How many numbers, the first, the last, and a sum that weights each one differently; few are told one by one."""
    flat = np.ravel(np.ma.filled(np.ma.asarray(values, float), np.nan))
    if len(flat) <= 6:
        return "(" + " ".join(_number(one) for one in flat) + ")"
    weighted = np.nansum(flat * np.cos(np.arange(len(flat))))
    return f"[{len(flat)}: {_number(flat[0])} to {_number(flat[-1])}, {_number(weighted)}]"


def _number(value: float) -> str:
    return f"{float(f'{value:.4g}') + 0.0:g}" if abs(value) > 1e-9 or value != value else "0"


def _grid(axis) -> bool:
    return bool(axis.get_tick_params().get("gridOn", False))


def _colours(colours) -> str:
    return (
        " ".join(dict.fromkeys(to_hex(one, keep_alpha=True) for one in np.atleast_2d(colours))) if len(colours) else ""
    )


def _told(one: Artist) -> str:
    common = f"z {one.get_zorder():g}" + (f" alpha {one.get_alpha():g}" if one.get_alpha() is not None else "")
    match one:
        case Legend():
            keys = [_told(key) for key in one.legend_handles if isinstance(key, Artist)]
            texts = [text.get_text() for text in one.get_texts()]
            return f"legend {one.get_title().get_text()!r} {texts} loc {one._loc} ncols {one._ncols} " + "; ".join(keys)
        case Text():
            if not one.get_text():
                return ""
            place = one.xyann if isinstance(one, Annotation) else one.get_position()
            at = f"{numbers(one.xy)} {one.anncoords}" if isinstance(one, Annotation) else ""
            style = f"{one.get_fontsize():.4g} {one.get_weight()} {one.get_ha()} {one.get_va()}"
            return f"text {one.get_text()!r} {numbers(place)} {at} {to_hex(one.get_color())} {style} {common}"
        case Line2D():
            marker = ""
            if one.get_marker() not in ("None", "", " "):
                face, edge = to_hex_of(one.get_markerfacecolor()), to_hex_of(one.get_markeredgecolor())
                marker = f" {one.get_marker()} {one.get_markersize():.4g} {face} {edge} {one.get_markeredgewidth():.4g}"
            style = f"{to_hex(one.get_color())} {one.get_linestyle()} {one.get_linewidth():.4g}"
            style += "" if one.get_drawstyle() == "default" else f" {one.get_drawstyle()}"
            style += "" if one.get_clip_on() else " unclipped"
            x, y = (np.asarray(part, float) for part in one.get_data(orig=False))
            return f"line {numbers(x)} {numbers(y)} {style}{marker} {common}"
        case Collection():
            paths = [path.vertices for path in one.get_paths() if len(path.vertices)]
            data = numbers(one.get_offsets()) + numbers(np.concatenate(paths) if paths else [])
            values = "" if one.get_array() is None else f"{numbers(one.get_array())} {one.get_cmap().name}"
            ends = "" if one.get_array() is None else numbers(one.get_clim())
            colours = "" if values else f"{_colours(one.get_facecolor())} / {_colours(one.get_edgecolor())}"
            return (
                f"collection {len(paths)} {data} {values} {ends} {colours} {numbers(one.get_linewidth())} "
                f"{getattr(one, 'hatches', '')} {common}"
            )
        case AxesImage():
            ends = f"{numbers(one.get_extent())} {numbers(one.get_clim())}"
            return (
                f"image {numbers(one.get_array())} {ends} {one.get_cmap().name} {one.origin} {one.get_interpolation()}"
            )
        case Patch():
            places = one.get_patch_transform().transform(one.get_path().vertices)
            colours = f"{to_hex_of(one.get_facecolor())} {to_hex_of(one.get_edgecolor())}"
            edge = f"{one.get_linewidth():.4g} {one.get_fill()} {one.get_hatch()}"
            return f"patch {numbers(places)} {colours} {edge} {common}"
    return ""


def to_hex_of(colour) -> str:
    """A colour with its alpha, or "none"."""
    return colour if isinstance(colour, str) and colour in ("none", "auto") else to_hex(colour, keep_alpha=True)
