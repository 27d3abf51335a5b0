"""Where ranges, files and doubts of a study end, from both sides of each limit."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.design import sampling
from papilla.design.confirming import Confirmed
from papilla.design.geometry import with_sites
from papilla.design.in_scene import DesignInScene
from papilla.design.places import Places, foil_of
from papilla.design.scene import DesignScene
from papilla.design.study import read_study
from papilla.model.finger import Finger

FINGER = Finger.default()
SPREAD = "{ low = 20.0, high = 50.0 }"


@pytest.mark.parametrize(
    "old, new, refused",
    [
        ('name = "made up"', 'name = ""', True),
        ('name = "made up"', 'name = "m"', False),
        ('name = "made up"', 'name = "made up"\nconfirm = 10', False),
        ('name = "made up"', 'name = "made up"\nconfirm = 11', True),
        ('name = "made up"', 'name = "made up"\nconfirm = -1', True),
        ('["sigma_sd", "signal_over_noise"]', "[]", True),
        ('["sigma_sd", "signal_over_noise"]', '["sigma_sd"]', False),
        (f'"gauges.spread_deg" = {SPREAD}', "", False),
        (SPREAD, "{ low = 20.0, high = 50.0, levels = 1 }", True),
        (SPREAD, "{ values = [] }", True),
        (SPREAD, "{ values = [30.0] }", False),
        (SPREAD, "[20.0, nan]", True),
        (SPREAD, "{ low = 20.0, high = inf }", True),
        (SPREAD, '["20", "50"]', True),
        ("[sampler]", "[scene]\nforces = 2\nmoduli = 40\n[sampler]", False),
        ("[sampler]", "[scene]\nforces = 1\n[sampler]", True),
        ("[sampler]", "[scene]\nmoduli = 41\n[sampler]", True),
        ("[sampler]", "[scene]\nsamples = 0\n[sampler]", True),
        ("designs = 12", "designs = 10000000", False),
        ("designs = 12", "designs = 10000001", True),
        ("designs = 12", "designs = 12\nseed = 4294967295", False),
        ("designs = 12", "designs = 12\nseed = 4294967296", True),
        ("designs = 12", "designs = 12\ngeometries = 10001", True),
        (SPREAD, "{ low = 20.0, high = 50.0, levels = 1001 }", True),
        (SPREAD, "{ values = [" + "30.0, " * 1001 + "] }", True),
        ("[sampler]", "[scene]\nsamples = 1000001\n[sampler]", True),
        ('["sigma_sd", "signal_over_noise"]', '["sigma_sd", "sigma_sd"]', True),
        ('name = "made up"', f'name = "{"x" * 200}"', False),
        ('name = "made up"', f'name = "{"x" * 201}"', True),
        ('name = "made up"', 'name = "two\\nlines"', True),
        ('name = "made up"', 'name = "\\u202Egnp.exe"', True),
        ('name = "made up"', f'name = "made up"\nstore = "{"x" * 1001}"', True),
        ('name = "made up"', f'name = "made up"\nfinger = "{"x" * 1001}"', True),
        ("[couplings]", "[couplings]\n" + f'"{"x" * 100_000}" = "1"', True),
        ("[couplings]", "\n".join(["[fixed]", *(f"k{k} = 1.0" for k in range(201)), "[couplings]"]), True),
        ("[couplings]", "\n".join([*(f"k{k} = [1.0, 2.0]" for k in range(51)), "[couplings]"]), True),
        ("outer.modulus_MPa / 4", " + ".join(["outer.modulus_MPa"] * 20_000), True),
    ],
)
def test_numbers_of_a_study_file(study_file, old, new, refused):
    path = study_file((old, new))
    if refused:
        with pytest.raises(InputError, match=r"study\.toml") as said:
            read_study(path)
        assert "\n" not in str(said.value) and len(str(said.value)) < 1000
    else:
        read_study(path)


@pytest.mark.parametrize("levels, refused", [(215, False), (216, True), (1000, True)])
def test_the_product_of_a_grid_is_bounded(study_file, levels, refused):
    """215**3 is just below ten million, 216**3 above."""
    grid = '"shape.skin_mm" = { low = 2.9, high = 3.1, levels = 5 }\n'.replace("5", str(levels))
    spread = f"{{ low = 20.0, high = 50.0, levels = {levels} }}"
    outer = '"outer.modulus_MPa" = [0.1, 0.6]', f'"outer.modulus_MPa" = {{ low = 0.1, high = 0.6, levels = {levels} }}'
    path = study_file(("[couplings]", grid + "[couplings]"), (SPREAD, spread), outer, ("designs = 12", 'kind = "grid"'))
    if refused:
        with pytest.raises(InputError, match=f"number of designs of the grid must be .* got {levels**3}"):
            read_study(path)
    else:
        assert read_study(path).most_designs == sampling.count(read_study(path))[0] == levels**3


def test_a_study_takes_what_the_finger_states(study_file, tmp_path):
    coupled = (
        "[couplings]\n",
        '[couplings]\n"inner.nu" = "outer.nu * shape.outer.x_mm / 24 - shape.bone.z_mm / 100"\n',
    )
    study = read_study(study_file(coupled))
    assert study.fixed == {"outer.nu": FINGER.outer.nu, "shape.outer.x_mm": 24.0, "shape.bone.z_mm": 6.0}
    middle = study.finger_of({one.name: one.at(0.5) for one in study.free})
    assert middle.inner.nu == pytest.approx(FINGER.outer.nu - 0.06)
    assert [one.name for one in study.outer] == []
    doubts = read_study(study_file(("[sampler]", '[doubts]\nfriction = "stick"\nthickness_mm = 5.0\n[sampler]')))
    assert (doubts.scene.unknown.friction, doubts.scene.unknown.doubts.thickness_mm) == ("stick", 5.0)
    assert study.scene.unknown.friction == "unknown"
    replace(FINGER, bench=replace(FINGER.bench, friction="stick", thickness=7.0)).save(tmp_path / "own.toml")
    own = read_study(study_file(('name = "made up"', 'name = "made up"\nfinger = "own.toml"\nstore = "s.sqlite"')))
    assert (own.scene.unknown.friction, own.scene.unknown.doubts.thickness_mm) == ("stick", 7.0)
    assert own.store == tmp_path / "s.sqlite" and own.sha256 != study.sha256
    assert read_study(study_file()).sha256 == read_study(study_file()).sha256


@pytest.mark.parametrize("share, verdict", [(1.099, "within 10 %"), (1.101, "off by +10 %"), (0.901, "within 10 %"),
                                            (0.899, "off by -10 %")])  # fmt: skip
def test_a_prediction_is_confirmed_within_a_tenth(share, verdict):
    ones = np.ones((2, 3))
    one = Confirmed("f", {"S_d": 0.2 * share * ones}, {"S_d": 0.2 * ones}, DesignScene())
    assert one.sentence == f"f: S_d: predicted {0.2 * share:.3g}, calibrated 0.2 ({verdict})"


def test_the_grid_of_a_scene_extends_beyond_it():
    force, modulus = DesignScene((0.2, 0.8), (0.1, 0.4)).grid
    assert np.unique(force) == pytest.approx(np.geomspace(0.2 / 1.25, 0.8 * 1.25, 10))
    assert np.unique(modulus) == pytest.approx(np.geomspace(0.1 / 1.05, 0.4 * 1.05, 14))
    assert len(force) == len(modulus) == 140 and force[0] == force[13] < force[14] and modulus[0] < modulus[1]
    assert DesignScene((0.2, 0.5)).swept_N[-1] == pytest.approx(0.525) and DesignScene().swept_N[-1] == 1.0
    for parts in ({"forces": 2}, {"moduli": 40}):
        assert DesignScene(**parts).points[0][0] == pytest.approx(0.2)
    for name in ("samples", "gauge_noise_microstrain", "force_noise_N", "depth_noise_mm", "depth_mm", "place_mm"):
        with pytest.raises(InputError, match=name):
            DesignScene(**{name: 0})


def test_a_design_needs_two_gauges_that_differ_and_a_press_inside_the_model(made_up_geometry):
    places = Places.of(FINGER)
    geometry = made_up_geometry(with_sites(FINGER, places), places)
    alone = DesignInScene(replace(FINGER, gauges=FINGER.gauges[2:3]), geometry, DesignScene())
    row = Places.row(foil_of(FINGER.gauges))
    wide = made_up_geometry(with_sites(FINGER, row), row)
    for finger in (
        replace(FINGER, gauges=FINGER.gauges[2:3]),
        replace(FINGER, gauges=(FINGER.gauges[2], replace(FINGER.gauges[2], name="g9"))),
    ):
        with pytest.raises(InputError, match="S_d needs at least two gauges whose readings differ"):
            _ = replace(alone, finger=finger, geometry=wide).surfaces
    hard = DesignScene((0.2, 0.98), (0.05, 90.0))
    design = DesignInScene(FINGER, geometry, hard)
    force, modulus = hard.grid
    inside = geometry.ends[0].inside(force, modulus, *design.moduli)
    k = int(np.flatnonzero(~inside)[0])
    with pytest.raises(InputError, match=rf"contact patch or table\): {force[k]:.3g} N on {modulus[k]:.3g} MPa"):
        _ = design.ends
