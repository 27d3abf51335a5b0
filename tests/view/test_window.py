"""The choice of an offscreen window, and the fall back where there is none."""

import os

import pytest

from papilla.view import render


@pytest.fixture(autouse=True)
def forget(monkeypatch):
    """Each test chooses anew and leaves the environment as it was."""
    monkeypatch.delenv(render.ENVIRONMENT, raising=False)
    render.use_offscreen_window.cache_clear()
    yield
    render.use_offscreen_window.cache_clear()


@pytest.mark.parametrize(
    "working, chosen",
    [
        (set(render.HEADLESS), "vtkEGLRenderWindow"),
        ({"vtkOSOpenGLRenderWindow"}, "vtkOSOpenGLRenderWindow"),
        (set(), None),
    ],
)
def test_the_first_kind_that_works_is_used(working, chosen, monkeypatch):
    monkeypatch.setattr(render.sys, "platform", "linux")
    monkeypatch.setattr(render, "_works", lambda kind: kind in working)
    assert render.use_offscreen_window() == (chosen is not None)
    assert os.environ.get(render.ENVIRONMENT) == chosen
    # The function sets the variable for good; the next test must not see it
    os.environ.pop(render.ENVIRONMENT, None)


def test_what_the_user_set_is_the_only_kind_tried(monkeypatch):
    tried = []
    monkeypatch.setenv(render.ENVIRONMENT, "vtkMine")
    monkeypatch.setattr(render, "_works", lambda kind: tried.append(kind))
    assert not render.use_offscreen_window()
    assert tried == ["vtkMine"]


def test_elsewhere_than_linux_the_platform_s_own_window_is_tried(monkeypatch):
    monkeypatch.setattr(render.sys, "platform", "darwin")
    monkeypatch.setattr(render, "_works", lambda kind: kind is None)
    assert render.use_offscreen_window()
    assert render.ENVIRONMENT not in os.environ


def test_a_probe_that_crashes_or_hangs_means_no(monkeypatch):
    monkeypatch.setattr(render, "_PROBE", "import os; os.abort()")
    assert not render._works("vtkEGLRenderWindow")
    monkeypatch.setattr(render, "_PROBE", "import time; time.sleep(60)")
    monkeypatch.setattr(render, "PROBE_SECONDS", 0.2)
    assert not render._works(None)


def test_a_probe_that_ends_well_means_yes(monkeypatch):
    monkeypatch.setattr(
        render, "_PROBE", "import os; raise SystemExit(os.environ['VTK_DEFAULT_OPENGL_WINDOW'] != 'mine')"
    )
    assert render._works("mine")
    assert not render._works("other")
