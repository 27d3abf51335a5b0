"""The choice of an offscreen window, and the fall back where there is none."""

import os

import pytest

from papilla.view import window


@pytest.fixture(autouse=True)
def forget(monkeypatch):
    """Each test chooses anew and leaves the environment as it was."""
    monkeypatch.delenv(window.ENVIRONMENT, raising=False)
    window.use_offscreen_window.cache_clear()
    yield
    window.use_offscreen_window.cache_clear()


@pytest.mark.parametrize(
    "working, chosen",
    [
        (set(window.HEADLESS), "vtkEGLRenderWindow"),
        ({"vtkOSOpenGLRenderWindow"}, "vtkOSOpenGLRenderWindow"),
        (set(), None),
    ],
)
def test_the_first_kind_that_works_is_used(working, chosen, monkeypatch):
    monkeypatch.setattr(window.sys, "platform", "linux")
    monkeypatch.setattr(window, "_works", lambda kind: kind in working)
    assert window.use_offscreen_window() == (chosen is not None)
    assert os.environ.get(window.ENVIRONMENT) == chosen
    # The function sets the variable for good; the next test must not see it
    os.environ.pop(window.ENVIRONMENT, None)


def test_what_the_user_set_is_the_only_kind_tried(monkeypatch):
    tried = []
    monkeypatch.setenv(window.ENVIRONMENT, "vtkMine")
    monkeypatch.setattr(window, "_works", lambda kind: tried.append(kind))
    assert not window.use_offscreen_window()
    assert tried == ["vtkMine"]


def test_elsewhere_than_linux_the_platform_s_own_window_is_tried(monkeypatch):
    monkeypatch.setattr(window.sys, "platform", "darwin")
    monkeypatch.setattr(window, "_works", lambda kind: kind is None)
    assert window.use_offscreen_window()
    assert window.ENVIRONMENT not in os.environ


def test_a_probe_that_crashes_or_hangs_means_no(monkeypatch):
    monkeypatch.setattr(window, "_PROBE", "import os; os.abort()")
    assert not window._works("vtkEGLRenderWindow")
    monkeypatch.setattr(window, "_PROBE", "import time; time.sleep(60)")
    monkeypatch.setattr(window, "PROBE_SECONDS", 0.2)
    assert not window._works(None)


def test_a_probe_that_ends_well_means_yes(monkeypatch):
    monkeypatch.setattr(
        window, "_PROBE", "import os; raise SystemExit(os.environ['VTK_DEFAULT_OPENGL_WINDOW'] != 'mine')"
    )
    assert window._works("mine")
    assert not window._works("other")
