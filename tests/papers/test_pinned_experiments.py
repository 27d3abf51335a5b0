"""Experiments on the presses of a made-up finger give the numbers that they gave when the pins were written.

Finite elements would take minutes, and what they give is tested elsewhere; here it is what is made of it.
`python tests/papers/test_pinned_experiments.py [part ...]` (with tests/support on the path) writes the present
numbers, for a change that moves them on purpose.
"""

import sys
from pathlib import Path
from types import SimpleNamespace

import made_up_finger
import numpy as np
import pinned
import pytest

from papilla import fem
from papilla.verify.structured import cube
from papilla_papers.claims.experiments import counts, presses, softness, specimens, spectra, textiles, toolkit

KEPT = Path(__file__).with_name("pinned_experiments.json")


def silent(*_) -> None:
    """Tells nothing."""


def _pressed(patch) -> None:
    made_up_finger.instead_of_fem(patch)
    for module in (softness, toolkit):
        patch.setattr(module, "cached_sweep", made_up_finger.sweep)


def _softness(patch):
    _pressed(patch)
    return softness.run(silent)


def _without_cause(patch):
    """The parts that need no estimator of each sample."""
    _pressed(patch)
    reduced, other = made_up_finger.prepare(), softness.other_finger()
    calibration = softness.calibrated(reduced)
    table = softness.sweep(reduced, softness.MODULI, softness.FORCES_N)
    return [
        softness._against_9(softness.ASSUMED, False), softness._published(calibration, False),
        softness._on_three(softness.ASSUMED, False), softness._slow(table, other, False),
        softness._by_regression(calibration, other, False),
    ]  # fmt: skip


def _specimens(patch, cause=True):
    _pressed(patch)
    patch.setattr(specimens, "DRAWS", 6)
    patch.setattr(specimens, "NOISE", 600.0)  # So much that specimens are taken for each other
    return specimens.run(silent, cause)


def _presses(patch, cause=True):
    _pressed(patch)
    patch.setattr(presses, "_field", lambda finger, reduced, cause: {"cause": cause})
    return presses.run(silent, cause)


def _field(patch, cause=True):
    """Layers of cells with a strain that grows with the depth and the indentation."""
    _pressed(patch)
    z = np.linspace(15.0, 19.9, 50)
    points = np.concatenate([np.column_stack([0 * z + k % 2, 0 * z, z + 0.01 * k]) for k in range(4)])
    tets = np.arange(200).reshape(4, 50).T
    built = SimpleNamespace(points=0.1 * points * [1, 1, 10], tets=tets, layer=np.where(z > 17, 1, 2))

    def recover(model, own, press):
        strain = np.zeros((50, 3, 3))
        strain[:, 2, 2], strain[:, 0, 2] = -0.01 * (20 - z), 0.002 * z
        return SimpleNamespace(strain=press.indentation * strain * (1 + (model.finger.name == "homogeneous")))

    class Model:
        def __init__(self, finger, mesh):
            self.finger = finger

        def reduce(self):
            return made_up_finger.prepare(self.finger)

    patch.setattr(presses.mesh, "build", lambda finger: built)
    patch.setattr(fem, "FingerModel", Model)
    patch.setattr(fem, "recover", recover)
    finger = presses.Finger.default()
    return presses._field(finger, made_up_finger.prepare(finger), cause)


def _jobs(patch, cause=True):
    _pressed(patch)
    reduced = made_up_finger.prepare()
    return toolkit._main_job(softness.calibrated(reduced), reduced, cause), toolkit._friction(cause)


def _toolkit(patch):
    """The parts that need a model, with one that is made up."""
    _pressed(patch)
    calibration = SimpleNamespace(sigmas={"noise": 0.01, "mesh": 0.02})
    patch.setattr(toolkit, "calibrated", lambda reduced: calibration)
    patch.setattr(toolkit, "_main_job", lambda *given: {"job": given[2]})
    patch.setattr(toolkit, "verify", lambda families: [SimpleNamespace(passed=k > 0) for k in range(len(families) + 2)])
    built = SimpleNamespace(tets=np.zeros((40, 4), int))
    space = SimpleNamespace(displacement=1.0, mesh=SimpleNamespace(tets=np.zeros((10, 4), int)))
    patch.setattr(toolkit.mesh, "build", lambda finger: built)
    patch.setattr(fem, "FingerModel", lambda finger, mesh: SimpleNamespace(space=space))
    patch.setattr(fem, "recover", lambda *_: "field")
    patch.setattr(toolkit, "_exported", lambda field: 1.0 if field == "field" else 0.0)
    prices = SimpleNamespace(hertz=1, mesh=None, small_strain=2)
    patch.setattr(toolkit, "known_prices", lambda *_: prices)
    picture = np.zeros((4, 6, 4))
    picture[1:3, 2:5, 0] = 0.8
    patch.setattr(toolkit, "imread", lambda stream: picture if stream.read() == b"png" else None)
    patch.setattr(toolkit.view, "strain_picture", lambda *_: b"png")
    return [toolkit.run(silent, cause) for cause in (True, False)]


def _short(patch, module) -> None:
    """One seed, and half the usual seconds."""
    real = module.noisy_scene
    patch.setattr(module, "SEEDS", range(1))
    patch.setattr(module, "noisy_scene", lambda *given, **how: real(*given, **{"seconds": 1.4, **how}))


def _counts(patch):
    _short(patch, counts)
    return counts.run(silent), counts._told_apart(False)


def _spectra(patch):
    _short(patch, spectra)
    patch.setattr(spectra, "WINDOWS_MS", (24, 32))
    return spectra.run(silent), spectra._finest(False)


def _textiles(patch, cause=True):
    """The search of bands, of which a made-up one answers by its records."""

    def match(records, rate, scores, bands):
        low, high = bands[int(1e3 * abs(records[0, 0])) % len(bands)][1:]
        return SimpleNamespace(low_Hz=low + scores[0], high_Hz=high)

    patch.setattr(textiles, "SEEDS", range(1))
    patch.setattr(textiles.texture, "matching_band", match)
    patch.setattr(textiles, "_chance", lambda rng, bands, cause: rng.uniform(0.5, 1.0))
    return textiles.run(silent, cause) if cause else textiles._searches(textiles.texture.printed_bands(), False)


def _written(patch):
    """A field that is written and read again."""
    mesh = cube(2)
    strain = np.zeros((len(mesh.tets), 3, 3))
    return toolkit._exported(fem.Field(mesh, 0.1 * mesh.points, strain, strain))


PARTS = {
    "softness": _softness,
    "softness without cause": _without_cause,
    "specimens": _specimens,
    "specimens without cause": lambda patch: _specimens(patch, False),
    "presses": _presses,
    "presses without cause": lambda patch: _presses(patch, False),
    "field": _field,
    "field without cause": lambda patch: _field(patch, False),
    "jobs": _jobs,
    "jobs without cause": lambda patch: _jobs(patch, False),
    "toolkit": _toolkit,
    "counts": _counts,
    "spectra": _spectra,
    "textiles": _textiles,
    "textiles without cause": lambda patch: _textiles(patch, False),
    "field that is written": _written,
}


@pytest.mark.parametrize("part", PARTS)
def test_an_experiment_gives_its_numbers(part, monkeypatch):
    assert pinned.same(PARTS[part](monkeypatch), KEPT, part) == []


if __name__ == "__main__":
    pinned.update(PARTS, KEPT, sys.argv[1:])
