"""Materials: closed forms against their own energies, small-strain limits, clear refusals."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.model.finger import Finger
from papilla.model.materials import TEST_MODES, FirstInvariantMaterial, NeoHookean, Ogden, Yeoh, principal_pair
from papilla.model.parts import Layer

CARDS = [NeoHookean(0.3), Yeoh(0.17, -0.03, 0.002), Ogden(0.11, 3.3), Ogden(0.2, -1.5)]


def _energy(card, stretch, mode):
    driven, free = principal_pair(stretch, mode)
    third = {"uniaxial": free, "equibiaxial": driven, "pure_shear": np.ones_like(driven)}[mode]
    stretches = np.stack([driven, third, free], axis=-1)
    return card.energy((stretches**2).sum(axis=-1) if isinstance(card, FirstInvariantMaterial) else stretches)


@pytest.mark.parametrize("mode", TEST_MODES)
@pytest.mark.parametrize("card", CARDS, ids=repr)
def test_nominal_stress_is_the_slope_of_the_energy(card, mode):
    stretch, h = np.array([0.5, 0.9, 1.0, 1.3, 2.0]), 1e-5
    slope = (_energy(card, stretch + h, mode) - _energy(card, stretch - h, mode)) / (2 * h)
    sides = 2 if mode == "equibiaxial" else 1
    assert card.nominal_stress(stretch, mode) == pytest.approx(slope / sides, rel=1e-7, abs=1e-9)
    factor = {"uniaxial": 3, "equibiaxial": 6, "pure_shear": 4}[mode]
    assert card.nominal_stress(1 + 1e-6, mode) / 1e-6 == pytest.approx(factor * card.shear_modulus, rel=1e-5)
    assert card.modulus == 3 * card.shear_modulus


@pytest.mark.parametrize("card", [card for card in CARDS if isinstance(card, FirstInvariantMaterial)], ids=repr)
def test_slopes_are_the_derivatives_of_the_energy(card):
    i1, h = np.array([3.0, 3.5, 6.0]), 1e-4
    first, second = card.slopes(i1)
    assert first == pytest.approx((card.energy(i1 + h) - card.energy(i1 - h)) / (2 * h), rel=1e-7)
    assert second == pytest.approx((card.slopes(i1 + h)[0] - card.slopes(i1 - h)[0]) / (2 * h), rel=1e-7, abs=1e-12)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: NeoHookean(0), r"neo-Hookean mu \(MPa\) must be greater than 0, got 0"),
        (lambda: Yeoh(1, float("nan")), r"Yeoh c2 \(MPa\) must be finite"),
        (lambda: Yeoh(-1), r"Yeoh c1 \(MPa\) must be greater than 0"),
        (lambda: Ogden(1, 0), "Ogden alpha must not be 0"),
        (lambda: NeoHookean(1).nominal_stress(1.1, "shear"), "test mode must be one of uniaxial, equibiaxial"),
        (lambda: NeoHookean(1).nominal_stress([1.1, -0.5], "uniaxial"), r"stretch must be .* greater than 0, got -0.5"),
        (lambda: NeoHookean(1).nominal_stress(np.inf, "uniaxial"), "stretch must be finite .* got inf"),
    ],
)
def test_refusals_name_what_is_wrong(make, message):
    with pytest.raises(InputError, match=message):
        make()


def _log_energy(card, e):
    stretches = np.exp([e[0], e[1], -e[0] - e[1]])
    return float(card.energy(stretches if isinstance(card, Ogden) else (stretches**2).sum()))


@pytest.mark.parametrize("card", CARDS, ids=repr)
@pytest.mark.parametrize("strains", [(0.0, 0.0), (0.3, -0.1), (0.8, -0.4)])
def test_stability_is_the_least_curvature_of_the_energy_over_logarithmic_strains(card, strains):
    step, angles = 1e-4, np.linspace(0, np.pi, 721)
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    lengths = np.sqrt((ways**2).sum(axis=1) + ways.sum(axis=1) ** 2)
    at = [np.array([_log_energy(card, strains + sign * step * way) for way in ways]) for sign in (-1, 0, 1)]
    curvature = (at[0] - 2 * at[1] + at[2]) / (step * lengths) ** 2
    found = card.stability(np.exp([*strains, -sum(strains)]))
    assert found == pytest.approx(curvature.min() / card.shear_modulus, rel=1e-3, abs=1e-5)


@dataclass(frozen=True)
class Gent(FirstInvariantMaterial):
    """A rubber with a limited extension; `off` spoils a slope."""

    mu: float
    limit: float
    off: tuple[float, float] = (1.0, 1.0)

    def energy(self, i1):
        return -self.mu * self.limit / 2 * np.log(1 - (np.asarray(i1) - 3) / self.limit)

    def slopes(self, i1):
        first = self.mu / 2 / (1 - (np.asarray(i1) - 3) / self.limit)
        return self.off[0] * first, self.off[1] * 2 * first**2 / (self.mu * self.limit)


def test_a_rubber_of_ones_own_is_a_material():
    rubber = Gent(0.1, 30.0)
    layer = Layer.of(rubber, nu=0.4999)
    assert layer.modulus == pytest.approx(2 * 0.1 * 1.4999)
    far = Gent(0.1, 1e9)
    for mode in TEST_MODES:
        assert far.nominal_stress(1.7, mode) == pytest.approx(NeoHookean(0.1).nominal_stress(1.7, mode), rel=1e-6)
    assert rubber.describe() != far.describe()
    finger = replace(Finger.default(), outer=layer)
    assert finger.sha256 != replace(finger, outer=Layer.of(Gent(0.1, 31.0))).sha256


@pytest.mark.parametrize("off, name", [((1.01, 1.0), "dW/dI1"), ((1.0, 1.5), r"d2W/dI1\^2")])
def test_slopes_that_are_not_those_of_the_energy_are_named(off, name):
    with pytest.raises(InputError, match=rf"layer material Gent: {name} at I1 = 3.05 is .* by differences"):
        Layer.of(Gent(0.1, 3.0, off))
    with pytest.raises(InputError, match="shear modulus"):
        Layer.of(Gent(-0.1, 3.0))


def test_a_design_file_cannot_hold_a_rubber_of_ones_own(tmp_path):
    with pytest.raises(InputError, match="cannot hold the material Gent: it has neo-hookean, yeoh, ogden"):
        replace(Finger.default(), outer=Layer.of(Gent(0.1, 30.0))).save(tmp_path / "finger.toml")
    assert [*tmp_path.iterdir()] == []
