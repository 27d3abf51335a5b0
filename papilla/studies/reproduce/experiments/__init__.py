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
        module.SIMULATED,
        **dict(zip(("removed", "noise", "seeds"), module.SCENE, strict=False)),
        assumed=getattr(module, "ASSUMED", None),
        varied=getattr(module, "VARIED", {}),
    )
    for module in _MODULES
)
"""`SCENE` of a module: what is removed where it runs without its cause, its noise in words, its seeds. `ASSUMED` and
`VARIED`, where a row is computed with other values of what is not printed."""
