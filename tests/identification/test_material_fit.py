"""Fits of materials: exact recovery, what they confess, and published rubber data where they are at hand."""

import os
from pathlib import Path

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.identification.material_fit import MaterialTests, fit_material, model_stress
from papilla.model.materials import TEST_MODES, NeoHookean, Ogden, Yeoh

CARDS = [NeoHookean(0.3), Yeoh(0.17, -0.004, 0.002), Ogden(0.11, 3.3)]


def sampled(card, noise=0.0, seed=0, stretch=None, modes=TEST_MODES) -> MaterialTests:
    """Synthetic tests of a material in the given modes, with noise in MPa."""
    stretch = np.linspace(0.7, 2.2, 12) if stretch is None else np.asarray(stretch)
    parts = [MaterialTests(stretch, card.nominal_stress(stretch, mode), mode) for mode in modes]
    data = MaterialTests.join(parts)
    return MaterialTests(data.stretch, data.stress + noise * np.random.default_rng(seed).normal(size=36), data.mode)


@pytest.mark.parametrize("card", CARDS, ids=repr)
def test_a_fit_recovers_the_material_that_made_the_data(card):
    data = sampled(card)
    fit = fit_material(card.kind, data)
    assert fit.values == pytest.approx(list(card.describe().values())[1:], rel=1e-7)
    assert fit.rms < 1e-9 and fit.points == 36 and fit.modes == TEST_MODES and fit.stretch_range == (0.7, 2.2)
    assert model_stress(fit.material, data) == pytest.approx(data.stress, abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("card", CARDS, ids=repr)
def test_stated_errors_are_those_of_repeated_fits(card):
    truth = np.array(list(card.describe().values())[1:])
    fits = [fit_material(card.kind, sampled(card, noise=0.01, seed=seed)) for seed in range(60)]
    pulls = np.array([(fit.values - truth) / fit.stderr for fit in fits])
    assert np.sqrt((pulls**2).mean(axis=0)) == pytest.approx(1.0, abs=0.3)
    assert np.mean([fit.rms for fit in fits]) == pytest.approx(0.01, rel=0.1)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
@pytest.mark.parametrize("card", CARDS, ids=repr)
def test_units_of_stress_do_not_matter(card, scale):
    data = sampled(card, noise=0.01)
    here = fit_material(card.kind, data)
    there = fit_material(card.kind, MaterialTests(data.stretch, scale * data.stress, data.mode))
    unit = np.array([1.0 if name == "alpha" else scale for name in here.names])
    assert there.values / unit == pytest.approx(here.values, rel=1e-8)
    assert there.stderr / unit == pytest.approx(here.stderr, rel=1e-6)
    assert (there.rms / scale, there.condition) == pytest.approx((here.rms, here.condition), rel=1e-6)
    assert there.notes == here.notes


def test_parameters_that_cannot_be_told_apart_are_doubted():
    fit = fit_material("ogden", sampled(Ogden(0.11, 3.3), 0.0005, stretch=np.linspace(1, 1.02, 12)))
    assert fit.stderr[1] > 1
    wide = fit_material("ogden", sampled(Ogden(0.11, 3.3), 0.001, stretch=np.linspace(1, 6, 12)))
    assert wide.notes == (f"mu and alpha are correlated by {wide.correlation[0, 1]:.3f}",)
    assert wide.correlation[0, 1] < -0.95


def test_a_parameter_at_its_bound_is_doubted():
    stretch = np.linspace(1.01, 1.3, 12)
    steep = MaterialTests(stretch, 1e-3 * np.expm1(60 * (stretch - 1)), "uniaxial")
    assert "alpha stopped at its bound" in fit_material("ogden", steep).notes


def test_a_parameter_that_the_data_do_not_see_is_doubted():
    """At a strain of 1e-7 the cubic term of Yeoh is 1e-28 of the linear one."""
    stretch = 1 + np.linspace(1e-7, 2e-7, 12)
    fit = fit_material("yeoh", MaterialTests(stretch, Yeoh(0.2).nominal_stress(stretch, "uniaxial"), "uniaxial"))
    assert {"the data do not determine c2", "the data do not determine c3"} <= set(fit.notes)
    assert {"c2 did not move from its start value", "c3 did not move from its start value"} <= set(fit.notes)
    assert np.isnan(fit.stderr[1:]).all() and fit.values[0] == pytest.approx(0.2, rel=1e-6)
    assert np.isfinite(fit.stderr[0])


UNI = "uniaxial"
REFUSED = {
    "material must be one of neo-hookean, yeoh, ogden": lambda: fit_material("mooney", sampled(CARDS[0])),
    "more than 3 points": lambda: fit_material("yeoh", MaterialTests([1, 1.1, 1.2, 1.3], [0, 1, 2, 3], UNI)),
    "no positive stiff": lambda: fit_material("ogden", MaterialTests([1.1, 1.2, 1.3], [-1, -2, -3], UNI)),
    "stretch and stress must be equally long": lambda: MaterialTests([1.1, 1.2], [1.0], UNI),
    r"stress \(MPa\) must be finite": lambda: MaterialTests([1.1], [np.nan], UNI),
    "test mode must be one of .* got 'torsion'": lambda: MaterialTests([1.1], [1.0], "torsion"),
    "stretch must be finite and greater than 0": lambda: MaterialTests([1.1, -0.2], [1.0, 2.0], UNI),
}


@pytest.mark.parametrize("message", REFUSED)
def test_refusals_name_what_is_wrong(message):
    with pytest.raises(InputError, match=message):
        REFUSED[message]()


def _folder(name: str) -> Path:
    root = Path(os.environ.get("PAPILLA_DATA") or Path(__file__).parents[3] / "shared" / "data")
    if not (root / name).is_dir():
        pytest.skip(f"no data: {name} is neither in $PAPILLA_DATA nor in ../shared/data")
    return root / name


def _multiaxial(*files: str) -> MaterialTests:
    folder, tests = _folder("rubber_multiaxial"), []
    for file, mode in zip(files, ("uniaxial", "equibiaxial", "pure_shear"), strict=True):
        tests.append(MaterialTests(*np.loadtxt(folder / file, delimiter=",", comments="#").T, mode))
    return MaterialTests.join(tests)


def test_meunier_silicone_in_all_modes_at_once():
    data = _multiaxial("Meunier_uniax.csv", "Meunier_equbiax.csv", "Meunier_shear.csv")
    fit = fit_material("yeoh", data)
    assert fit.values == pytest.approx([0.179, -0.0041, 0.0019], abs=6e-5, rel=3e-3)
    assert fit.points == 55 and fit.rms == pytest.approx(0.029, abs=5e-4)
    assert fit.notes == () and fit.modes == TEST_MODES
    # The other two cannot follow equibiaxial and compression at once
    assert min(fit_material(kind, data).rms for kind in ("neo-hookean", "ogden")) > 3 * fit.rms


def test_treloar_rubber_in_all_modes_at_once():
    """Natural rubber up to a stretch of 7.6: c1 and the upturn are Yeoh's (mu about 0.33 MPa), neo-Hookean fails."""
    data = _multiaxial("treloar_uni.csv", "treloar_equibi.csv", "treloar_pure_shear.csv")
    fit = fit_material("yeoh", data)
    assert fit.values == pytest.approx([0.1665, -8.68e-4, 2.987e-5], rel=2e-3)
    assert fit.points == 43 and fit.rms == pytest.approx(0.112, abs=1e-3)
    assert fit.notes == ("c2 and c3 are correlated by -0.976",)
    assert fit_material("neo-hookean", data).rms > 5 * fit.rms


@pytest.mark.parametrize(
    "name, mu, alpha",
    [
        ("Ecoflex 00-30", 14.6, 2.40),
        ("Ecoflex 00-50", 19.7, 2.50),
        ("Dragon Skin 10 MEDIUM", 40.3, 3.25),
        ("Dragon Skin 20", 111.9, 3.30),
        ("Dragon Skin 30", 168.7, 3.05),
        ("RTV615", 303, 3.05),
    ],
)
def test_commercial_silicones_to_100_percent(name, mu, alpha):
    lines = (_folder("soro_tensile") / f"{name}.csv").read_text(encoding="utf-8-sig", errors="replace").splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("Time (s);")) + 1
    table = np.array([[float(cell) for cell in line.split(";")] for line in lines[first:] if line.strip(";")])
    table = table[table[:, 3] <= 1.0]
    fit = fit_material("ogden", MaterialTests(1 + table[:, 3], table[:, 4], "uniaxial"))
    assert fit.values * [1e3, 1] == pytest.approx([mu, alpha], rel=0.012)
    assert fit.rms < 0.02 * table[:, 4].max()
