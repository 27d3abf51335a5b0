"""The experiments, one module each, in the order of the table."""

from papilla.studies.reproduce.claim import Experiment
from papilla.studies.reproduce.experiments import (
    counts,
    impulses,
    presses,
    remote,
    softness,
    spectra,
    textiles,
    wavelets,
)

EXPERIMENTS: tuple[Experiment, ...] = tuple(
    module.EXPERIMENT for module in (presses, softness, impulses, counts, spectra, wavelets, textiles, remote)
)
