"""What follows from the size and hardness of a finger: round factors, and the patch of a design that states none."""

from dataclasses import replace

import numpy as np
import pytest
from scaled_finger import scaled_finger

from papilla.mesh.body import narrowest_mm, patch_radius_mm
from papilla.mesh.scale import FingerScale, rounded
from papilla.model.finger import DEFAULT_FINGER, SHIPPED_FINGERS, Finger

SLAB = DEFAULT_FINGER.with_name("slab_finger.toml")


def test_a_round_factor_is_near_and_the_same_in_each_decade():
    rng = np.random.default_rng(1)
    for factor in np.exp(rng.uniform(-9, 9, 200)).tolist():
        assert 1 / 1.3 < rounded(factor) / factor < 1.3
        assert rounded(1000 * factor) == pytest.approx(1000 * rounded(factor), rel=1e-12)
        assert rounded(rounded(factor)) == rounded(factor) == float(f"{rounded(factor):.2g}")
    for name in SHIPPED_FINGERS:
        scale = FingerScale.of(Finger.load(name))
        assert rounded(scale.force) == rounded(scale.modulus) == scale.length == 1


def test_lengths_and_moduli_scale_as_they_are_drawn():
    rng = np.random.default_rng(2)
    for _ in range(20):
        length, stress = np.exp(rng.uniform(-1, 1, 2)).tolist()
        scale = FingerScale.of(scaled_finger(Finger.default(), length, stress))
        assert (scale.length, scale.modulus) == pytest.approx((length, stress), rel=1e-12)
        assert scale.force == pytest.approx(length**2 * stress, rel=1e-12)


def test_a_patch_that_is_not_stated_follows_from_the_shape(tmp_path):
    default = Finger.default()
    assert patch_radius_mm(replace(default, patch_radius=None)) == patch_radius_mm(default) == 15
    assert patch_radius_mm(replace(default, patch_radius=7.0)) == 7
    for finger in (default, Finger.load(SLAB)):
        plain = replace(finger, patch_radius=None)
        for length in np.random.default_rng(3).uniform(0.3, 3, 5).tolist():
            larger = scaled_finger(plain, length, 1.0)
            assert patch_radius_mm(larger) == pytest.approx(length * patch_radius_mm(plain), rel=1e-12)
            larger.save(tmp_path / "finger.toml")
            again = Finger.load(tmp_path / "finger.toml")
            assert again.patch_radius is None and again.sha256 == larger.sha256
        slim = replace(plain.shape, outer=(12.0, *plain.shape.outer[1:]), interface=(11.0, *plain.shape.interface[1:]))
        assert patch_radius_mm(replace(plain, shape=slim)) < patch_radius_mm(plain)
    slab = replace(Finger.load(SLAB), patch_radius=None)
    assert patch_radius_mm(slab) > max(slab.shape.depth / 2, 0.7 * narrowest_mm(slab)), "contacts reach both ends"
