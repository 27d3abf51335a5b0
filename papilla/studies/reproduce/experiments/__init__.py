"""The experiments, one module each, in the order of the table."""

from papilla.studies.reproduce.claim import Experiment
from papilla.studies.reproduce.experiments import counts, impulses, spectra, textiles, wavelets

EXPERIMENTS: tuple[Experiment, ...] = tuple(
    module.EXPERIMENT for module in (impulses, counts, spectra, wavelets, textiles)
)
