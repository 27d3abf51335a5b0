"""Pictures and plots, offscreen: `view.strain`, `view.receptive` and `view.contact` write PNG files.

>>> papilla.view.strain("strain.png", finger, reduced, press, specimen)

They render with VTK where it can (EGL, OSMesa) and with matplotlib alone where it cannot. `papilla.view.plots` makes
figures of arrays. Everything is imported on first use.
"""

from importlib import import_module as _import_module

_HOME = {
    "contact": "papilla.view.pictures",
    "receptive": "papilla.view.pictures",
    "strain": "papilla.view.pictures",
    "strain_png": "papilla.view.pictures",
    "contact_figure": "papilla.view.contact_map",
    "receptive_figure": "papilla.view.receptive_field",
    "strain_figure": "papilla.view.strain_field",
    "png": "papilla.view.style",
    "svg": "papilla.view.style",
}
"""Functions of the package and the module that defines each."""

__all__ = [*_HOME, "plots"]


def __getattr__(name: str):
    """PEP 562: import what is asked for when it is first asked for."""
    if name == "plots":
        return _import_module("papilla.view.plots")
    if name not in _HOME:
        raise AttributeError(f"module 'papilla.view' has no attribute {name!r}")
    return getattr(_import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
