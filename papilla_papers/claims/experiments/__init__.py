"""The experiments, one module each, in the order of the table."""

from importlib import import_module

from papilla_papers.claims.claim import Experiment

_NAMES = (
    "presses", "softness", "specimens", "fitted", "impulses", "counts", "gratings", "spectra", "wavelets", "textiles",
    "telepresence", "toolkit",
)  # fmt: skip

EXPERIMENTS: tuple[Experiment, ...] = tuple(
    Experiment(
        name,
        module.run,
        **module.SCENE.about,
        assumed=getattr(module, "ASSUMED", None),
        varied=getattr(module, "VARIED", {}),
    )
    for name in _NAMES
    for module in (import_module(f"{__name__}.{name}"),)
)
"""Attributes of a module. `SCENE`: its table in `scenes.toml`, with `about` (fields of `Experiment`) and `picture` (its
words). `ASSUMED` and `VARIED`, if rows are computed with other values of parameters that are not printed."""
