"""Study files: what they mean, and that each fault is one line before anything runs."""

import pytest

from papilla.core.errors import InputError
from papilla.design.parameters import made, parameters_of
from papilla.design.study import read_study
from papilla.model.finger import Finger

FREE = '"outer.modulus_MPa" = [0.1, 0.6]'


def test_a_study_makes_fingers(study_file):
    study = read_study(study_file())
    finger = study.finger_of({"outer.modulus_MPa": 0.4, "gauges.spread_deg": 30.0})
    assert (finger.outer.modulus, finger.inner.modulus) == (0.4, 0.1)
    assert [gauge.angle_deg for gauge in finger.gauges] == [-30, -15, 0, 15, 30]
    assert study.couplings and not study.outer and len(study.places.gauges(finger.shape)) == 17


@pytest.mark.parametrize(
    "change, said",
    [
        ((FREE, '"outer.modulus_MPa" = [0.6, 0.1]'), "empty range"),
        ((FREE, '"outer.modulus_MPa" = [0.6, 0.1, 0.2]'), "[low, high]"),
        (("outer.modulus_MPa / 4", "outer.modulus / 4"), "did you mean 'outer.modulus_MPa'"),
        (("outer.modulus_MPa / 4", "__import__('os').getcwd()"), "couplings"),
        (("high = 50.0", "high = 80.0"), "outside the places"),
        (("high = 50.0", "hihg = 50.0"), "hihg"),
        (('"sigma_sd"', '"sigma_ds"'), "did you mean 'sigma_sd'"),
        (("designs = 12", "design = 12"), "did you mean designs"),
        (("designs = 12", "designs = 1.5"), "sampler.designs must be a valid integer"),
        (("designs = 12", 'kind = "random"'), "sampler.kind must be 'grid', 'sobol' or 'optimise'"),
        (("[sampler]", "[scene]\nforce_N = 0.3\n[sampler]"), "scene.force_N must be [low, high], two finite numbers"),
        (("[sampler]", "[scene]\nmodulus_MPa = [0.1, 0.2, 0.3]\n[sampler]"), "[low, high], two finite numbers"),
        (("[sampler]", '[doubts]\nfriction = "some"\n[sampler]'), "friction"),
        (("[sampler]", '[fixed]\n"shape.skin_mm" = 14.0\n[sampler]'), "semi-axis"),
        (("[sampler]", '[fixed]\n"gauges.count" = 1\n[sampler]'), "needs 2 gauges"),
        (("[sampler]", '[fixed]\n"outer.modulus_MPa" = 1\n[sampler]'), "two of free, fixed and couplings"),
        (('name = "made up"', 'name = "made up"\nobjektives = []'), "did you mean 'objectives'"),
    ],
)
def test_a_fault_is_one_line_with_file_and_key(study_file, change, said):
    path = study_file(change)
    with pytest.raises(InputError, match="study.toml") as refused:
        read_study(path)
    assert said in str(refused.value) and "\n" not in str(refused.value)


def test_layers_may_move_together_but_not_cross():
    finger = Finger.default()
    smaller = made(finger, {"shape.outer.z_mm": 16.0, "shape.skin_mm": 2.0})
    assert smaller.shape.outer == (24, 30, 16) and smaller.shape.interface == (22, 28, 14)
    third = made(finger, {"shape.scale": 1 / 3})
    assert third.shape.bone[2] == pytest.approx(2.0) and third.patch_radius == pytest.approx(5.0)
    with pytest.raises(InputError, match="thicker"):
        made(finger, {"shape.skin_mm": 14.0})
    with pytest.raises(InputError, match="surface files"):
        parameters_of(Finger.load("papilla/data/surfaces_finger.toml"))
