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
    Experiment(module.__name__.rpartition(".")[2], module.run, module.SIMULATED, *module.SCENE) for module in _MODULES
)
"""`SCENE` of a module: what is removed where it runs without its cause, its noise in words, its seeds."""
