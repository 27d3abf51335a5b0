"""The experiments, one module each, in the order of the table."""

from importlib import import_module

from papilla_papers.claims.claim import Experiment

_NAMES = (
    "presses", "softness", "specimens", "fitted", "impulses", "counts", "gratings", "spectra", "wavelets", "textiles",
    "telepresence", "toolkit",
)  # fmt: skip

ALL_EXPERIMENTS: tuple[Experiment, ...] = tuple(import_module(f"{__name__}.{name}").experiment for name in _NAMES)
