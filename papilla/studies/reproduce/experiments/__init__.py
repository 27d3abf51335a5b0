"""The experiments, one module each, in the order of the table."""

from papilla.studies.reproduce.claim import Experiment
from papilla.studies.reproduce.experiments import (
    counts,
    fitted,
    gratings,
    impulses,
    presses,
    remote,
    softness,
    specimens,
    spectra,
    textiles,
    toolkit,
    wavelets,
)

EXPERIMENTS: tuple[Experiment, ...] = tuple(
    module.EXPERIMENT
    for module in (
        presses,
        softness,
        specimens,
        fitted,
        impulses,
        counts,
        gratings,
        spectra,
        wavelets,
        textiles,
        remote,
        toolkit,
    )
)
