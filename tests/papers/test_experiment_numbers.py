"""Parts of the papers' experiments give the numbers that they gave when their claims were judged.

The claims themselves have wide tolerances and are judged by slow tests. A changed scene, window or rule shows here
first, as another number. `python tests/papers/test_experiment_numbers.py [part ...]` (with tests/support on the path)
writes the present ones, for a change that moves them on purpose.
"""

import sys
from pathlib import Path

import numpy as np
import pinned
import pytest

from papilla_papers.claims.experiments import counts, gratings, impulses, spectra, telepresence, textiles, wavelets
from papilla_papers.methods import texture

KEPT = Path(__file__).with_name("experiment_numbers.json")
TIMED = ("computing_ms",)
"""Values that are times of this machine."""


def _rng(seed: int = 3) -> np.random.Generator:
    return np.random.default_rng(seed)


def _passive(cause: bool) -> dict:
    rng = _rng()
    runs = [(one, wavelets._passive(one, rng, cause)) for one in wavelets.PERIODS_MM for _ in range(wavelets.RUNS)]
    return wavelets._constant_parts(runs)


def _fabrics() -> dict:
    return {name: float(np.abs(textiles.fabric(name, _rng())).sum()) for name in textiles.YARNS_PER_INCH}


def _unrelated() -> dict:
    planted = textiles._unrelated(_rng(), planted=(40, 60), gains=np.array([1.0, 2.0, 3.0, 4.0]))
    shifted = textiles._shifted(textiles.SCENE.concordance)
    agreement = texture.concordance(textiles.SCENE.chance.scores, shifted).coefficient
    scores, bands = textiles._any_scores(_rng()), texture.printed_bands()
    chance = [textiles._chance(_rng(seed), bands, by) for seed in range(2) for by in (True, False)]
    return {"planted": np.abs(planted).sum(axis=0), "agreement": agreement, "scores": scores, "chance": chance}


def _plate() -> dict:
    plate = gratings.two_grooves(3.0)
    deep = plate.height_mm < 0
    edges = plate.x_mm[1:][np.diff(deep.astype(int)) != 0]
    wave = np.sin(np.linspace(0.0, 9 * np.pi, 400))
    place = np.linspace(0.0, 30.0, 3001)
    readings = np.column_stack([5 * np.sqrt(2) * np.sin(2 * np.pi * place / 1.5), 0 * place])
    rms = gratings._grating_rms(gratings.Felt(place, readings, 0.3, "", ""), 1.5)
    speed = gratings.Felt(place, readings, 0.3, "", "").speed_mm_s
    return {"edges": edges, "maxima": gratings._maxima(wave), "rms": rms, "speed": speed}


PARTS = {
    "wavelets passive": lambda: _passive(True),
    "wavelets passive without cause": lambda: _passive(False),
    "wavelets contours": lambda: wavelets._contours(_rng(), True),
    "wavelets formulas": lambda: wavelets._formulas(_rng(wavelets.SCENE.formulas.seed)),
    "wavelets phases": lambda: wavelets._phases(True),
    "wavelets phases without cause": lambda: wavelets._phases(False),
    "wavelets active": lambda: wavelets._modulated(wavelets.ASSUMED),
    "wavelets nearest": lambda: {
        str(cause): wavelets.accuracy(wavelets.campaign(5), wavelets.SCENE.left_out[0], cause)
        for cause in (True, False)
    },
    "textiles weaves": textiles._weaves,
    "textiles scores": lambda: textiles._scores(_rng(textiles.SCENE.assessors.seed)),
    "textiles bands": lambda: textiles._bands(texture.random_bands(50, 1), texture.printed_bands()),
    "textiles runs": lambda: textiles._textiles(_rng(), True),
    "textiles runs without cause": lambda: textiles._textiles(_rng(), False),
    "textiles fabrics": _fabrics,
    "textiles best": lambda: textiles._fabrics(textiles.ASSUMED),
    "textiles unrelated": _unrelated,
    "impulses rules": impulses._rules,
    "impulses grooves": impulses._grooves,
    "impulses line": lambda: impulses._line(True),
    "impulses spectrum": lambda: impulses._spectrum(True),
    "spectra by hand": lambda: {"share": spectra._by_hand()},
    "spectra components": lambda: spectra._components(True),
    "spectra components without cause": lambda: spectra._components(False),
    "counts period": lambda: counts._period(counts.ASSUMED),
    "telepresence links": telepresence._links,
    "telepresence amplitudes": telepresence._amplitudes,
    "gratings plate": _plate,
}


def _timeless(part):
    """A part without the times of this machine, as a function of a monkeypatch that it does not need."""

    def numbers(_=None):
        found = part()
        return {name: found[name] for name in found if name not in TIMED}

    return numbers


@pytest.mark.parametrize("part", PARTS)
def test_an_experiment_gives_its_numbers(part):
    assert pinned.same(_timeless(PARTS[part])(), KEPT, part) == []


if __name__ == "__main__":
    pinned.update({name: _timeless(part) for name, part in PARTS.items()}, KEPT, sys.argv[1:])
