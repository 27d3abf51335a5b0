"""The published estimators as printed, against prototypes that were written apart and run on the same scenes.

A second implementation is the only check of a formula that has no closed-form answer on a noisy grating.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from papilla.studies.estimator_bench.competitors import AS_PRINTED
from papilla.studies.estimator_bench.rows import SceneRow

COLUMNS = (("const", 20.0), ("const", 0.0), ("act1", 20.0), ("act2", 20.0), ("harsh", 20.0))
PERCENT: Mapping[str, tuple[float, ...]] = MappingProxyType(
    {
        "impulse density (2006)": (48.9, 52, 73, 113, 75),
        "interval (2006)": (62, 70, 73, 67, 74),
        "STFT 200 ms (2006)": (3.3, 3.4, 125, 144, 191),
        "zero crossing (2007)": (12.6, 59, 42, 39, 62),
        "STFT 32 ms (2011)": (16.6, 22.5, 27, 21, 31),
    }
)
"""RMS error of the wavelength in % that the prototypes had in the scenes of `COLUMNS`."""
LAGS_MS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "impulse density (2006)": (81, 94),
        "STFT 200 ms (2006)": (104, 103),
        "zero crossing (2007)": (41, 40),
        "STFT 32 ms (2011)": (56, 15),
    }
)
"""Their lags in act1 and act2, ms."""
TOLERANCE = 0.3
NOTES: Mapping[tuple[str, str, str], str] = MappingProxyType(
    {
        ("STFT 32 ms (2011)", "harsh", "error_answered"): (
            "the prototype took the mean off each window, which the paper does not say: without it the baseline leaks "
            "into the lowest line"
        ),
        ("STFT 32 ms (2011)", "act1", "lag_ms"): (
            "half of the window is 16 ms, which is also what the prototype had in act2"
        ),
    }
)
"""Why a figure differs, where the reason is known."""


@dataclass(frozen=True)
class Prototype:
    """One figure of a prototype and ours.

    measure : "error_answered" (a fraction; prototypes always answered, so only answers are compared) or "lag_ms".
    differs : by more than 30 %. note : why, where it is known.
    """

    estimator: str
    scene: str
    snr_dB: float
    measure: str
    prototype: float
    ours: float
    ratio: float
    differs: bool
    note: str


def against_prototypes(scenes: Sequence[SceneRow]) -> tuple[Prototype, ...]:
    """Every figure of the prototypes whose estimator and scene were run."""
    rows = {(row.estimator, row.scene, row.snr_dB): row for row in scenes}
    found = []
    for name, figures in PERCENT.items():
        known = [
            (kind, snr, "error_answered", value / 100) for (kind, snr), value in zip(COLUMNS, figures, strict=True)
        ]
        lags = zip(("act1", "act2"), LAGS_MS.get(name, ()), strict=False)
        known += [(kind, 20.0, "lag_ms", value) for kind, value in lags]
        for kind, snr, measure, value in known:
            row = rows.get((f"{name}, {AS_PRINTED}", kind, snr))
            if row is not None:
                ours = getattr(row, measure)
                differs = not abs(ours / value - 1) <= TOLERANCE
                note = NOTES.get((name, kind, measure), "") if differs else ""
                found.append(Prototype(name, kind, snr, measure, value, ours, ours / value, differs, note))
    return tuple(found)
