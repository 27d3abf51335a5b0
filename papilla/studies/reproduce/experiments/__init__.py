"""The experiments, one module each, in the order of the table."""

from papilla.studies.reproduce.claim import Experiment
from papilla.studies.reproduce.experiments import (
    counts,
    fitted,
    gratings,
    impulses,
    presses,
    softness,
    specimens,
    spectra,
    telepresence,
    textiles,
    toolkit,
    wavelets,
)

_MODULES = (
    presses, softness, specimens, fitted, impulses, counts, gratings, spectra, wavelets, textiles, telepresence, toolkit
)  # fmt: skip

EXPERIMENTS: tuple[Experiment, ...] = tuple(
    Experiment(
        module.__name__.rpartition(".")[2],
        module.run,
        **module.SCENE.about,
        assumed=getattr(module, "ASSUMED", None),
        varied=getattr(module, "VARIED", {}),
    )
    for module in _MODULES
)
"""Attributes of a module. `SCENE`: its table in `scenes.toml`, with `about` (fields of `Experiment`) and `picture` (its
words). `ASSUMED` and `VARIED`, if rows are computed with other values of parameters that are not printed."""
