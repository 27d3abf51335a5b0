"""How large a comparison is: which estimators, scenes, noises, seeds and steps."""

from dataclasses import dataclass, field

from papilla.errors import InputError
from papilla.studies.estimator_bench.scenes import SCENES, WAVELENGTHS_MM

HELD_OUT = 30_000
"""First seed of the comparison: tuning used seeds below it, and whoever tunes by these moves it on."""


def _conditions() -> tuple[tuple[str, float], ...]:
    """Every scene from 40 to -6 dB; constant speed, where outliers are counted, in finer steps."""
    finer = [("const", snr) for snr in (40.0, 30.0, 20.0, 10.0, 6.0, 3.0, 0.0, -3.0, -6.0)]
    return tuple(finer + [(name, snr) for name in SCENES[1:] for snr in (40.0, 20.0, 10.0, 0.0, -6.0)])


@dataclass(frozen=True)
class Plan:
    """The size of a comparison.

    Parameters
    ----------
    names : parts of competitors' names, none for all.
    wavelengths_mm, seeds, seconds : of the scenes; the first second is for settling, errors are RMS over all.
    conditions : (scene, SNR in dB).
    steps_mm : wavelengths before and after a step at constant speed; phases : places in the period where steps happen.
    delays_ms, gains : by how much the known velocity is late or wrong, in act1 at 20 dB.
    draws : noises of the Monte-Carlo maximum-likelihood fit.
    cost_seconds : length of the scene on which an estimator is timed, sample by sample.

    Raises `InputError` for a plan without seeds, or scenes of less than 2 s.
    """

    names: tuple[str, ...] = ()
    wavelengths_mm: tuple[float, ...] = WAVELENGTHS_MM
    seeds: tuple[int, ...] = tuple(range(HELD_OUT, HELD_OUT + 6))
    seconds: float = 4.0
    conditions: tuple[tuple[str, float], ...] = field(default_factory=_conditions)
    steps_mm: tuple[tuple[float, float], ...] = ((1.0, 4.0), (3.0, 0.6))
    phases: int = 4
    delays_ms: tuple[int, ...] = (0, 1, 2, 5, 10)
    gains: tuple[float, ...] = (1.01, 1.03)
    draws: int = 300
    cost_seconds: float = 4.0

    def __post_init__(self):
        if not self.seeds:
            raise InputError("seeds must hold at least one seed, got none")
        if not self.seconds >= 2:
            raise InputError(f"seconds must be at least 2 (the first is for settling), got {self.seconds:g}")


LONG = Plan()
SHORT = Plan(
    names=("zero crossing", "STFT 32 ms", "reciprocal", "space tracker", "chirp"),
    wavelengths_mm=(0.6, 3.0),
    seeds=(HELD_OUT, HELD_OUT + 1),
    seconds=3.0,
    conditions=(("const", 20.0), ("const", 0.0), ("const", -6.0), ("act1", 20.0), ("act2", 20.0), ("harsh", 20.0)),
    phases=1,
    delays_ms=(0, 2, 10),
    gains=(1.03,),
    draws=60,
    cost_seconds=0.5,
)
"""For a quick look and for tests: too few seeds for a verdict on a target."""
