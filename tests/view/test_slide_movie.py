"""The movie of a slide: frames, signals and texture of a made-up slide."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image
from skfem import Basis, ElementTriP2, ElementVector, MeshTri

from papilla.core.errors import InputError
from papilla.view import slide_movie

RATE = 100.0


def slide(rows=60):
    """Two gauges, of which the second has the larger signal, at 100 Hz."""
    t = np.arange(rows) / RATE
    readings = np.column_stack([5 + np.sin(40 * t), 100 + 10 * np.sin(40 * t)])
    motion = SimpleNamespace(t_s=t, rate_Hz=RATE, position_mm=50 * t)
    return SimpleNamespace(
        motion=motion, readings=readings, gauge_names=["g1", "a$"], force_N=np.full(rows, 0.5),
        depth_mm=np.full(rows, 0.4), carried_mm=np.full(rows, 0.1), x_mm=np.array([-1.0, 0.0, 1.0]), ridge_pitch_mm=0.0,
        pressing=np.outer(1 + t, [1.0, 2.0, 1.0]), rubbing=np.zeros((rows, 3)),
    )  # fmt: skip


TEXTURE = SimpleNamespace(span=(-100.0, 100.0), recess=lambda place: np.where(place > 2.0, 0.7, 0.0))


def test_signals_of_the_last_quarter_of_a_second():
    axes, found = Figure().subplots(), slide()
    slide_movie._draw_signals(axes, found, 50)
    first, second = axes.lines
    assert list(first.get_xdata()) == pytest.approx(np.arange(25, 51) / RATE)
    change = found.readings - found.readings.mean(axis=0)
    assert first.get_ydata() == pytest.approx(change[25:51, 0]) and second.get_ydata() == pytest.approx(
        change[25:51, 1]
    )
    assert axes.get_xlim() == pytest.approx((0.25, 0.5))
    low, high = axes.get_ylim()
    assert -low == high == pytest.approx(np.percentile(np.abs(change), slide_movie.COMMON))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["g1", "a$"]
    slide_movie._draw_signals(axes, found, 3)
    assert len(axes.lines[0].get_xdata()) == 4 and axes.get_xlim() == pytest.approx((0.0, 0.25))
    slide_movie._draw_signals(axes, slide(rows=11), 3)
    assert axes.get_xlim() == pytest.approx((0.0, 0.1))


def test_fields_of_a_slide_are_those_of_its_forces():
    """A section whose answer is the forces' sum times (x + 2 y, 3 y): strain along x is that sum."""
    mesh = MeshTri().refined(1)
    scalar, whole = Basis(mesh, ElementTriP2()), Basis(mesh, ElementVector(ElementTriP2()))
    component = whole.split_indices()
    unit = np.zeros(whole.N)
    (x, y), places = whole.doflocs[:, component[0]], whole.doflocs[:, component[1]]
    unit[component[0]], unit[component[1]] = x + 2 * y, 3 * places[1]
    weights = np.eye(6)
    model = SimpleNamespace(
        patch_weights=(weights, None), solve=lambda loads: np.outer(unit, loads.sum(axis=0)), scalar=scalar, mesh=mesh,
        component=component,
    )  # fmt: skip
    found = slide()
    found.rubbing = np.outer(np.arange(60), [0.0, 1.0, 0.0])
    moved, strain = slide_movie._fields(model, found, np.array([3, 50]))
    sums = found.pressing[[3, 50]].sum(axis=1) + [3, 50]
    assert strain == pytest.approx(np.repeat(sums[:, None], mesh.nelements, axis=1))
    x, y = mesh.p
    assert moved == pytest.approx(np.multiply.outer(sums, np.stack([x + 2 * y, 3 * y], axis=-1)))


def test_the_texture_lies_where_the_slide_has_come_to():
    axes, found = Figure().subplots(), slide()
    slide_movie._draw_texture(axes, TEXTURE, found, 20, 8.0, 6.0)
    outline = axes.collections[0].get_paths()[0].vertices
    # At 0.2 s the finger has come 10.1 mm: place 2 mm of the texture is at x = -8.1 mm, which is not shown
    assert outline[:, 1].min() == pytest.approx(8.0 - 0.4 + 0.7) and outline[:, 1].max() == 8.0 + slide_movie.OVER_MM
    axes.clear()
    slide_movie._draw_texture(axes, TEXTURE, found, 0, 8.0, 6.0)
    under = axes.collections[0].get_paths()[0].vertices
    steps = under[np.isclose(under[:, 1], 7.6), 0]
    assert steps.min() == pytest.approx(-6.0) and steps.max() == pytest.approx(1.9, abs=0.02)
    bars = axes.collections[1].get_segments()
    heights = [np.ptp(bar[:, 1]) for bar in bars]
    assert (
        heights[1] == pytest.approx(2 * heights[0]) == pytest.approx(2.2 * found.pressing[0, 1] / found.pressing.max())
    )
    assert [bar[0, 0] for bar in bars] == [-1.0, 0.0, 1.0]


def test_frames_are_evenly_spaced_samples(tmp_path, monkeypatch):
    points = np.array([[-4.0, 0.0], [4.0, 0.0], [0.0, 8.0]])
    made = SimpleNamespace(section=SimpleNamespace(points=points, triangles=np.array([[0, 1, 2]]), half_width=4.0))
    asked = []

    def fields(model, found, samples):
        asked.append(samples.tolist())
        return np.zeros((len(samples), 3, 2)), np.full((len(samples), 1), 0.01)

    monkeypatch.setattr(slide_movie, "SectionModel", lambda finger, section: made)
    monkeypatch.setattr(slide_movie, "build_section", lambda finger: asked.append(finger))
    monkeypatch.setattr(slide_movie, "_fields", fields)
    path = tmp_path / "slide.gif"
    found = slide()
    finger = SimpleNamespace(ridge_pitch_mm=found.ridge_pitch_mm)
    slide_movie.write_slide_movie(path, finger, TEXTURE, found, frames=4)
    assert asked == [finger, [0, 20, 39, 59]]
    with Image.open(path) as movie:
        assert movie.n_frames == 4 and movie.size == (648, 540) and movie.info["duration"] == 80
        shown = []
        for frame in range(4):
            movie.seek(frame)
            shown.append(np.asarray(movie.convert("RGB"), int))
    assert all(np.abs(shown[0] - one).max() > 50 for one in shown[1:])
    assert sorted(item.name for item in tmp_path.iterdir()) == ["slide.gif"]
    with pytest.raises(InputError, match="written as .gif"):
        slide_movie.write_slide_movie(tmp_path / "slide.mp4", None, TEXTURE, slide())
    with pytest.raises(InputError, match="the finger has ridges every 1.3 mm, the one that slid every"):
        slide_movie.write_slide_movie(path, SimpleNamespace(ridge_pitch_mm=1.3), TEXTURE, slide())
