"""Pictures of made-up results draw what they drew when the pins were written (`support/pinned.py` says what for).

The other tests of this folder compare data, limits and words with values found another way. These pin everything that
is drawn: places, colours, widths and sizes. `python tests/view/test_pinned_pictures.py` (with tests/support on the
path) prints what is drawn now, for a change that is made on purpose and looked at.
"""

import base64
import contextlib
import json
import math
import tempfile
from pathlib import Path
from types import SimpleNamespace

import made_up_press
import numpy as np
import pytest
import pyvista as pv
from artists import numbers, shown, shown_axes
from made_up_press import FINGER, SPECIMEN, press, reduced
from matplotlib.figure import Figure

from benchmarks.estimators.honesty_figure import honesty_figure
from papilla.cli.speed.price_figure import price_figure
from papilla.model.specimen import Block, Sphere
from papilla.view import (
    contact_map,
    log_picture,
    plots,
    receptive_field,
    render,
    slide_movie,
    strain_field,
    style,
    turning,
)
from papilla_papers import study_plots

BLOCK = Block(0.2, 4.0)
KEPT = Path(__file__).with_name("pinned_pictures.json")
FORCE, MODULI = np.linspace(0.05, 1, 20), np.array([0.05, 0.5, 5.0])
SD = 1e4 * FORCE[:, None] ** 0.6 * MODULI**0.1


def _contact(sharpness: float = 0.5, two: bool = False, ellipse: bool = True) -> list[str]:
    found, one = reduced(at=(1.0, 0.0) if two else (0.0, 0.0), sharpness=sharpness)
    if not ellipse:
        # Two patches beside each other, of an area whose ellipse would go beyond what was meshed
        one.pressure = np.roll(one.pressure.reshape(61, 61), 30, axis=0).ravel()
        one.contact_area *= 6
    other = (press(pressure=0.5 * one.pressure, modulus=0.9), SimpleNamespace(modulus=0.9, words="ball"))
    return shown(contact_map.contact_figure(found, one, SPECIMEN, other if two else None))


def _log(off=(), gauges=("g1", "g$2"), optional=tuple(log_picture.MEASURED), spectrum=True) -> list[str]:
    rows = 400
    t = np.arange(rows) / 100
    codes = np.array(["start"] * 40 + ["ok"] * 200 + ["ok-low"] * 60 + ["far"] * 100)
    values = {"modulus": 0.5 + 0.01 * np.sin(t), "wavelength": 1.5 + 0.1 * np.cos(t), "friction": 0.3 + 0 * t}
    answer = {"frequency_Hz": 40 + t}
    for k, (name, (value, sigma, _)) in enumerate(log_picture.ANSWERS.items()):
        answer |= {value: values[name], sigma: 0.01 * values[name] * (k + 1), f"{name}_status": np.roll(codes, 30 * k)}
    columns = [t, *(np.sin((k + 3) * t) for k in range(len(gauges)))]
    columns += [np.cos((k + 2) * t) for k in range(len(optional))]
    picture = log_picture.LogPicture(gauges, optional, off)
    block = np.column_stack(columns)
    for part in (slice(0, 150), slice(150, rows)):
        picture.add(block[part], SimpleNamespace(**{name: column[part] for name, column in answer.items()}))
    lines = [
        SimpleNamespace(wavelength_mm=w, harmonic=h) for w, h in ((1.5, 1), (0.75, 2), (1.45, 1), (0.3, 1), (9.0, 1))
    ]
    wavenumber = np.linspace(0, 5, 9001)
    power = 1 + np.exp(-(((wavenumber - 1 / 1.5) / 0.01) ** 2)) * 50 + 0.5 * np.sin(100 * wavenumber)
    over = SimpleNamespace(wavenumber_per_mm=wavenumber, power=power, lines=lines)
    return shown(picture.figure("a_$log$.csv", "detail", over if spectrum else None))


def _plots() -> dict[str, Figure]:
    sigma, error = np.geomspace(1e-4, 0.9, 60).reshape(20, 3), np.array([0.01, -0.025, np.nan])
    pressed = np.array([0.2, 0.6]), np.array([0.06, 4.0]), np.array([3000.0, 9000.0]), np.array([100.0, 300.0])
    readings = 1000 * np.outer(FORCE, [-1.0, 2.0, 5.0, 2.0001, -1.5])
    return {
        "sd and force": plots.sd_against_force(FORCE, MODULI, SD, (FORCE[:5], [0.3, 3.0], SD[:5, 1:])),
        "sd of presses": plots.sd_of_presses(FORCE, MODULI, SD, pressed),
        "residuals": plots.residuals_against_force(FORCE, ["g1", "g2"], np.column_stack([FORCE, -FORCE])),
        "sd and modulus": plots.sd_against_modulus(MODULI, [0.1, 0.2], SD[:2]),
        "uncertainty": plots.uncertainty_map(FORCE, MODULI, sigma, sigma < 0.4, (0.2, 1.0, 0.05, 0.5)),
        "recovery": plots.recovery_map(np.array([0.2, 0.4, 0.8]), MODULI, error),
        "readings": plots.gauge_readings(FORCE, ["g1", "g2", "g3", "g4", "g5"], readings, "title"),
    }


def _studies() -> dict[str, Figure]:
    def row(scene, method, answered, false, median, kind="own", faults=()):
        told = {"scene": scene, "method": method, "kind": kind, "answered": answered, "false": false}
        return told | {"median": median, "faults": faults}

    honest = [
        row("slow", "pipeline", 0.8, 0.25, 0.002), row("fast", "pipeline", 0.5, math.nan, 9.0, faults=("late",)),
        row("slow", "STFT over the path", 1.0, 0.0, 1e-9), row("slow", "old", 0.9, 0.1, 0.3, kind="published"),
    ]  # fmt: skip
    presses = [
        {"fidelity": f, "element": e, "size_mm": s, "seconds_thousand": t, "error_sd": error, "pareto": best}
        for f, e, s, t, error, best in (
            ("contact", "P1", 0.7, 40.0, 0.01, False), ("contact", "P1", 1.4, 9.0, 0.04, True),
            ("contact", "TH", 1.4, 20.0, 0.005, True), ("finite", "TH", 1.4, 900.0, 0.003, False),
            ("hertz", "P2", 1.4, 2.0, 0.2, True), ("contact", "TH", 0.3, 9000.0, 0.0, False),
        )
    ]  # fmt: skip
    signals = [
        SimpleNamespace(wavelength_mm=w, pitch_mm=p, rms=np.array([w, 10 * w + p]))
        for w, p in ((2.0, 0.0), (1.0, 0.0), (2.0, 0.5), (1.0, 0.5))
    ]
    return {
        "honesty": honesty_figure(honest),
        "price": price_figure(presses, 0.3),
        "signals": study_plots.signals_figure(signals, ["g1", "a_$b$"]),
    }


def _texture():
    return SimpleNamespace(span=(-100.0, 100.0), recess=lambda place: np.where(place > 2.0, 0.7, 0.0))


def _slide():
    rows = 60
    t = np.arange(rows) / 100
    return SimpleNamespace(
        force_N=np.full(rows, 0.5), ridge_pitch_mm=0.5,
        motion=SimpleNamespace(t_s=t, rate_Hz=100.0, position_mm=50 * t), gauge_names=["g1", "a$"],
        readings=np.column_stack([np.sin(40 * t), 10 * np.sin(40 * t)]), depth_mm=np.full(rows, 0.4),
        carried_mm=np.full(rows, 0.1), x_mm=np.array([-1.0, 0.0, 1.0]), pressing=np.outer(1 + t, [1.0, 2.0, 1.0]),
    )  # fmt: skip


def _movie() -> list[str]:
    body, signal = Figure().subplots(2, 1)
    slide_movie._draw_texture(body, _texture(), _slide(), 10, 8.0, 6.0)
    slide_movie._draw_signals(signal, _slide(), 40)
    return shown_axes(body) + shown_axes(signal)


def _shape(surface: pv.PolyData, values: np.ndarray | None = None) -> str:
    """Bounds and area of a surface, and the integral of values at its points; not how VTK orders the points."""
    triangles = surface.triangulate()
    corners = np.asarray(triangles.points, float)[triangles.regular_faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    sums = [area.sum(), *(area @ corners.mean(axis=1))]
    if values is not None:
        sums.append(area @ values[triangles.regular_faces].mean(axis=1))
    return f"{numbers(surface.bounds)} {numbers(np.round(sums, 3))}"


def _drawn(at=(0.0, 0.0), what="strain", specimen=BLOCK, scale=1.0) -> list[str]:
    found, one = reduced(at=at)
    parts = strain_field.drawn(strain_field.Scene(made_up_press.dome(), one, specimen), found, FINGER, what, scale)
    lines = [
        _shape(pv.PolyData.from_regular_faces(face.points, face.triangles), face.values) for face in parts.section.faces
    ]
    for name, outlines in parts.section.outlines.items():
        ends = np.concatenate(outlines)
        middle = numbers(ends.mean(axis=0))
        lines.append(f"{name} {len(outlines)} {numbers([*ends.min(axis=0), *ends.max(axis=0)])} {middle}")
    lines += [f"skin {_shape(parts.skin)}", f"solid {_shape(parts.solid)}", f"touched {parts.touched}"]
    lines += [f"gauges {numbers(parts.section.gauges)}", *(f"bone {numbers(ring)}" for ring in parts.section.bone)]
    return lines + [f"outline {numbers(line)}" for line in parts.outline]


def _receptive(small: bool) -> list[str]:
    return shown(receptive_field.receptive_fields_figure(made_up_press.bump(), FINGER, small=small))


def _plain(value):
    """A plotly figure as lists, words and numbers."""
    if isinstance(value, dict) and "bdata" in value:
        return numbers(np.frombuffer(base64.b64decode(value["bdata"]), value["dtype"]))
    if isinstance(value, dict):
        return {name: _plain(one) for name, one in value.items() if name != "template"}
    if isinstance(value, np.ndarray):
        return numbers(value) if value.dtype.kind in "fiu" else value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return float(f"{value:.5g}") if isinstance(value, float) else value


@pytest.fixture
def kept():
    """What each picture showed when it was looked at."""
    return json.loads(KEPT.read_text(encoding="utf-8"))


PARTS = {
    "contact": _contact,
    "contact, no ellipse": lambda: _contact(ellipse=False),
    "contact, two": lambda: _contact(sharpness=0.8, two=True),
    "log": _log,
    "log without wavelength": lambda: _log(("wavelength", "modulus"), ("g1",), ("force_N",), False),
    "log of answers": lambda: _log((), (), ("velocity_mm_s",), False),
    "movie": _movie,
    "drawn": _drawn,
    "drawn, off the apex": lambda: _drawn((2.0, -3.0), "mises", Sphere(0.2, radius=8.0), 2.0),
    "receptive, small": lambda: _receptive(small=True),
    "receptive": lambda: _receptive(small=False),
}


def _same(found, kept) -> bool:
    return json.loads(json.dumps(found)) == kept


@pytest.mark.parametrize("part", PARTS)
def test_a_picture_is_as_it_was(part, kept):
    assert PARTS[part]() == kept[part]


def test_plots_are_as_they_were(kept):
    for name, figure in (_plots() | _studies()).items():
        assert shown(figure) == kept[name], name


def _strain(width: float | None, two: bool) -> Figure:
    found, one = reduced(at=(2.0, -3.0) if two else (0.0, 0.0))
    other = press(modulus=0.9, sd=99.0, resolved=False)
    beside = strain_field.Scene(None, other, SimpleNamespace(modulus=0.9, words="ball"))
    how = {"width": width, "beside": beside if two else None, "scale": 3.0 if two else 1.0}
    return strain_field.strain_figure(None, found, one, SPECIMEN, FINGER, **how)


def _rendered(monkeypatch) -> dict[str, list[str]]:
    """The same with VTK, of which a plotter without a window keeps what it is given."""
    given: list[str] = []

    class Plotter:
        def __init__(self, **how):
            self.camera = SimpleNamespace(enable_parallel_projection=lambda: given.append("parallel"))
            self.renderer = SimpleNamespace(reset_camera_clipping_range=lambda: given.append("range"))
            self.size = how["window_size"]
            given.append(f"plotter {how}")

        def add_light(self, light):
            given.append(f"light {numbers(light.position)} {light.intensity} {light.light_type}")

        def add_mesh(self, surface, **how):
            how = {name: getattr(value, "name", value) for name, value in how.items()}
            given.append(f"mesh {numbers(surface.bounds)} {surface.n_points} {how}")

        def screenshot(self, path, return_img):
            given.append(f"shot {path} {return_img} {numbers(self.camera.position)} {self.camera.parallel_scale:.5g}")
            return np.zeros((*self.size[::-1], 3), np.uint8)

        def close(self):
            given.append(f"closed {self.background_color}")

    monkeypatch.setattr(render.pv, "Plotter", Plotter)
    monkeypatch.setattr(render, "PIXELS_PER_MM", 1.0)
    monkeypatch.setattr(strain_field, "use_offscreen_window", lambda: True)
    monkeypatch.setattr(receptive_field, "use_offscreen_window", lambda: True)
    pictures = {
        "strain": shown(_strain(None, False)),
        "receptive of one": shown(receptive_field.receptive_figure(made_up_press.bump(), FINGER, "g2")),
    }
    return pictures | {"given": given}


def _flat(monkeypatch) -> dict[str, list[str]]:
    monkeypatch.setattr(strain_field, "use_offscreen_window", lambda: False)
    monkeypatch.setattr(receptive_field, "use_offscreen_window", lambda: False)
    return {
        "one": shown(_strain(None, False)),
        "two": shown(_strain(None, True)),
        "narrow": shown(_strain(style.NARROW_IN, False)),
        "receptive of one": shown(receptive_field.receptive_figure(made_up_press.bump(), FINGER, "g3")),
    }


def _frames(monkeypatch) -> dict[str, list[str]]:
    points = np.array([[-4.0, 0.0], [4.0, 0.0], [0.0, 8.0]])
    section = SimpleNamespace(points=points, triangles=np.array([[0, 1, 2]]), half_width=4.0)
    moved = np.arange(12.0).reshape(2, 3, 2) / 10
    kept: dict[str, list[str]] = {}

    class Writer:
        def __init__(self, fps):
            self.fps = fps

        @contextlib.contextmanager
        def saving(self, figure, path, dpi):
            self.figure = figure
            Path(path).touch()
            kept["saving"] = [f"{Path(path).suffix} {self.fps} {dpi} {style.matplotlib.rcParams['savefig.dpi']}"]
            yield

        def grab_frame(self):
            kept[f"frame {len(kept) + 1}"] = shown(self.figure)

    monkeypatch.setattr(slide_movie, "SectionModel", lambda finger, built: SimpleNamespace(section=section))
    monkeypatch.setattr(slide_movie, "build_section", lambda finger: None)
    monkeypatch.setattr(slide_movie, "_fields", lambda *_: (moved, np.array([[0.011], [0.02]])))
    monkeypatch.setattr(slide_movie, "PillowWriter", Writer)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "slide.gif"
        slide_movie.write_slide_movie(path, SimpleNamespace(ridge_pitch_mm=0.5), _texture(), _slide(), frames=2)
        kept["files"] = sorted(one.name for one in path.parent.iterdir())
    return kept


@pytest.mark.parametrize("how", [_rendered, _flat, _frames])
def test_pictures_of_a_solid_are_as_they_were(how, kept, made_up_parts, monkeypatch):
    found = how(monkeypatch)
    for name, lines in found.items():
        assert lines == kept[how.__name__][name], name


def _page(monkeypatch):
    go = pytest.importorskip("plotly.graph_objects")
    made = []
    monkeypatch.setattr(go.Figure, "to_html", lambda self, **how: made.append((self, how)) or "<head></head><head>")
    found, one = reduced(at=(1.0, -2.0))
    scenes = [strain_field.Scene(None, each, SPECIMEN) for each in (press(force=0.25), one)]
    page = turning.strain_html(scenes, found, FINGER, shown="zz")
    ((figure, how),) = made
    return {"page": page, "how": how, "figure": _plain(figure.to_dict())}


def test_the_page_is_as_it_was(kept, made_up_parts, monkeypatch):
    assert _same(_page(monkeypatch), kept["_page"])


def _all() -> dict:
    found = {name: part() for name, part in PARTS.items()}
    found |= {name: shown(figure) for name, figure in (_plots() | _studies()).items()}
    for how in (_rendered, _flat, _frames, _page):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(strain_field, "drawn", made_up_press.drawn)
            patch.setattr(turning, "drawn", made_up_press.drawn)
            found[how.__name__] = how(patch)
    return found


if __name__ == "__main__":
    print(json.dumps(_all(), indent=1, ensure_ascii=False))
