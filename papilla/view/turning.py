"""A page, made with plotly, that shows presses as solids which can be turned: the finger cut open, a slider over the
presses, and the reading of the gauge under the pointer."""

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from papilla.core.errors import MissingExtraError
from papilla.core.units import PER_CENT
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.model.finger import Finger
from papilla.view.strain_field import (
    SKIN_COLOR,
    SPECIMEN_COLOR,
    Drawn,
    PressScene,
    common_limit,
    drawn,
    points_of,
    shown_words,
    side_of,
)
from papilla.view.style import DIVERGING_COLORS, GAUGE_COLOR, INK_COLOR, RIGID_COLOR, STRAIN_QUANTITY

if TYPE_CHECKING:
    from pyvista import PolyData

EYE_DIRECTION, ZOOM_FACTOR = (0.0, -1.6, 0.58), 1.65
"""First direction of view and size of the finger, which fills the width of a phone. The cut side faces the viewer."""

LINE_PX = 3
"""Width of a line; that of a gauge is four times as large."""

LIFTED_MM, NAMES_MM = 0.3, 2.0
"""Distance of gauges, lines and names from the cut face, which would otherwise hide them."""

FLAT_LIGHT = {"ambient": 1.0, "diffuse": 0.0, "specular": 0.0}
"""Light of the coloured faces, whose shades must match the colour bar."""

SOFT_LIGHT = {"ambient": 0.9, "diffuse": 0.25, "specular": 0.0}
"""Light of skin and specimen."""


def need_plotly() -> None:
    """Raise `MissingExtraError` if plotly is not installed."""
    try:
        import plotly.graph_objects  # noqa: F401
    except ImportError as error:
        raise MissingExtraError("plotly is not installed; pip install 'papilla[view]'") from error


def strain_html(
    scenes: Sequence[PressScene], reduced: ReducedFinger, finger: Finger, *, quantity: str = STRAIN_QUANTITY
) -> str:
    """The page of presses of one specimen on `reduced`, self-contained; the last press is shown first.

    Raises `MissingExtraError` if plotly is not installed, and as `drawn`.
    """
    need_plotly()
    import plotly.graph_objects as go

    parts = [drawn(scene, reduced, finger, quantity) for scene in scenes]
    limit = common_limit(parts)
    side = side_of(reduced)
    lift = np.array([0, -side, 0])
    groups = [
        [*_solids(geometry, LIFTED_MM * lift), *_gauges(geometry, scene, finger, lift)]
        for geometry, scene in zip(parts, scenes, strict=True)
    ]
    titles = [_title(scene, finger) for scene in scenes]
    figure = go.Figure([trace for group in groups for trace in group])
    steps: list[dict[str, Any]] = []
    for number, (scene, title) in enumerate(zip(scenes, titles, strict=True)):
        visible = [index == number for index, group in enumerate(groups) for _ in group]
        args = [{"visible": visible}, {"title.text": title}]
        steps.append({"method": "update", "label": f"{scene.press.force:.3g} N", "args": args})
    for trace, now in zip(figure.data, steps[-1]["args"][0]["visible"], strict=True):
        trace.visible = now
    bar = {"title": shown_words(quantity).split(":")[0], "thickness": 12, "orientation": "h", "y": 0, "yanchor": "top"}
    scale: dict = {"colorscale": DIVERGING_COLORS, "cmin": -limit, "cmax": limit, "colorbar": bar}
    seen = points_of(parts)
    # plotly hides everything beyond the ends of an axis, so the axis must contain the lines in front of the cut
    low, high = seen.min(axis=0) - 2 * NAMES_MM, seen.max(axis=0) + 2 * NAMES_MM
    axes = {
        f"{axis}axis": {"visible": False, "range": [float(a), float(b)]}
        for axis, a, b in zip("xyz", low, high, strict=True)
    }
    sizes = dict(zip("xyz", (ZOOM_FACTOR * (high - low) / (high - low).max()).tolist(), strict=True))
    camera = {
        "eye": dict(zip("xyz", np.array(EYE_DIRECTION) * (1, side, 1), strict=True)),
        "projection.type": "orthographic",
    }
    figure.update_layout(
        title={"text": titles[-1], "font": {"size": 14}},
        coloraxis=scale,
        sliders=[{"active": len(scenes) - 1, "steps": steps, "currentvalue": {"prefix": "force "}, "pad": {"t": 70}}],
        scene={**axes, "aspectmode": "manual", "aspectratio": sizes, "camera": camera},
        font={"family": "DejaVu Sans, Verdana, sans-serif", "color": INK_COLOR},
        margin={"l": 30, "r": 30, "t": 90, "b": 10},
        showlegend=False,
    )
    page = figure.to_html(include_plotlyjs=True, full_html=True, div_id="strain", config={"responsive": True})
    view = '<meta name="viewport" content="width=device-width, initial-scale=1"><title>Strain field</title>'
    view += "<style>html, body { margin: 0; height: 100%; }</style>"
    return page.replace("<head>", f"<head>{view}", 1)


def _title(scene: PressScene, finger: Finger) -> str:
    press, touched = scene.press, f"{scene.specimen.modulus:.3g} MPa {scene.specimen.words}"
    facts = f"S<sub>d</sub> of the readings {press.sd:,.0f} µε, indentation {press.indentation:.3g} mm"
    return f"<b>{escape(finger.name)}</b><br>{press.force:.3g} N on a {touched}<br>{facts}"


def _solids(geometry: Drawn, lift: np.ndarray) -> list[Any]:
    """The cut, the skin behind it, the bone, the specimen and their lines."""
    import plotly.graph_objects as go

    quiet: dict[str, Any] = {"hoverinfo": "skip"}
    traces = [
        go.Mesh3d(
            **_mesh(face.points, face.triangles),
            intensity=face.values.astype(np.float32),
            coloraxis="coloraxis",
            lighting=FLAT_LIGHT,
            hovertemplate="%{intensity:.3g}<extra></extra>",
        )  # fmt: skip
        for face in geometry.section.faces
    ]
    for solid, color, flat in ((geometry.skin, SKIN_COLOR, False), (geometry.solid, SPECIMEN_COLOR, True)):
        traces.append(
            go.Mesh3d(**_mesh(*_triangles(solid)), color=color, flatshading=flat, lighting=SOFT_LIGHT, **quiet)
        )
    for ring in geometry.section.bone:
        around = 1 + np.arange(len(ring))
        fan = _mesh(np.vstack([ring.mean(axis=0), ring]), np.column_stack([0 * around, around, np.roll(around, -1)]))
        traces.append(go.Mesh3d(**fan, color=RIGID_COLOR, lighting=FLAT_LIGHT, **quiet))
    outlines = [line for lines in geometry.section.outlines.values() for line in lines]
    for lines, dash in ((outlines, "solid"), (geometry.outline, "dash")):
        ends = np.vstack([np.vstack([line, np.full((1, 3), np.nan)]) for line in lines]) if lines else np.empty((0, 3))
        line = {"color": INK_COLOR, "width": LINE_PX, "dash": dash}
        traces.append(go.Scatter3d(**_places(ends + lift), mode="lines", line=line, **quiet))
    return traces


def _gauges(geometry: Drawn, scene: PressScene, finger: Finger, lift: np.ndarray) -> list[Any]:
    """The gauges' grids, with the text under the pointer, and their names."""
    import plotly.graph_objects as go

    press, ends, hover_texts = scene.press, [], []
    for gauge, bar, strain, reading in zip(
        finger.gauges, geometry.section.gauges, press.strain, press.reading, strict=True
    ):
        facts = f"reading {reading:+,.0f} µε<br>strain {PER_CENT * strain:+.2f} %".replace("-", "−")
        words = f"{escape(gauge.name)}: {facts}"
        ends += [bar[0], bar.mean(axis=0), bar[1], np.full(3, np.nan)]
        hover_texts += [words, words, words, ""]
    grids = go.Scatter3d(
        **_places(np.array(ends) + LIFTED_MM * lift), mode="lines+markers", hovertext=hover_texts, hoverinfo="text",
        line={"color": GAUGE_COLOR, "width": 4 * LINE_PX}, marker={"color": GAUGE_COLOR, "size": LINE_PX},
    )  # fmt: skip
    middles = geometry.section.gauges.mean(axis=1) + NAMES_MM * lift
    names = [escape(gauge.name) for gauge in finger.gauges]
    return [
        grids,
        go.Scatter3d(**_places(middles), mode="text", text=names, textposition="top center", hoverinfo="skip"),
    ]


def _triangles(surface: "PolyData") -> tuple[np.ndarray, np.ndarray]:
    triangulated = surface.triangulate()
    return triangulated.points, triangulated.regular_faces


def _mesh(points: np.ndarray, triangles: np.ndarray) -> dict[str, np.ndarray]:
    return _places(points) | dict(zip("ijk", triangles.T.astype(np.int32), strict=True))


def _places(points: np.ndarray) -> dict[str, np.ndarray]:
    return dict(zip("xyz", points.T.astype(np.float32), strict=True))
