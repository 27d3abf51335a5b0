"""Study files: what they mean, and where their ranges and doubts end, from both sides of each limit."""

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
from papilla.design.study import Limit, read_study
from papilla.model.finger import Finger

FINGER = Finger.default()
FREE = '"outer.modulus_MPa" = [0.1, 0.6]'
SPREAD = "{ low = 20.0, high = 50.0 }"


NAME, GOALS, HEAD = 'name = "made up"', '["sigma_sd", "signal_over_noise"]', "[sampler]"
LEVELS = "{ low = 20.0, high = 50.0, levels = %d }"


@pytest.mark.parametrize(
    "old, new, said",
    [
        (FREE, '"outer.modulus_MPa" = [0.6, 0.1]', "empty range"),
        ("outer.modulus_MPa / 4", "outer.modulus / 4", "did you mean 'outer.modulus_MPa'"),
        ("outer.modulus_MPa / 4", "__import__('os').getcwd()", "couplings"),
        ("outer.modulus_MPa / 4", " + ".join(["outer.modulus_MPa"] * 20_000), "couplings"),
        ("high = 50.0", "high = 80.0", "outside the places"),
        ("high = 50.0", "hihg = 50.0", "hihg"),
        ('"sigma_sd"', '"sigma_ds"', "did you mean 'sigma_sd'"),
        ("designs = 12", "designs = 1.5", "sampler.designs must be a valid integer"),
        ("designs = 12", 'kind = "random"', "sampler.kind must be 'grid', 'sobol' or 'optimise'"),
        ("designs = 12", "designs = 10000000", None),
        ("designs = 12", "designs = 10000001", "designs"),
        ("designs = 12", "designs = 12\nseed = 4294967295", None),
        ("designs = 12", "designs = 12\nseed = 4294967296", "seed"),
        ("designs = 12", "designs = 12\ngeometries = 10001", "geometries"),
        (HEAD, "[scene]\nforce_N = 0.3\n[sampler]", r"scene.force_N must be \[low, high\], two finite numbers"),
        (HEAD, '[fixed]\n"shape.skin_mm" = 14.0\n[sampler]', "semi-axis"),
        (HEAD, '[fixed]\n"gauges.count" = 1\n[sampler]', "needs 2 gauges"),
        (HEAD, '[fixed]\n"outer.modulus_MPa" = 1\n[sampler]', "two of free, fixed and couplings"),
        (HEAD, "[scene]\nforces = 2\nmoduli = 40\n[sampler]", None),
        (HEAD, "[scene]\nmoduli = 41\n[sampler]", "moduli"),
        (HEAD, "[scene]\nsamples = 1000001\n[sampler]", "samples"),
        (NAME, NAME + "\nobjektives = []", "did you mean 'objectives'"),
        (NAME, NAME + "\nconfirm = 10", None),
        (NAME, NAME + "\nconfirm = 11", "confirm"),
        (NAME, f'name = "{"x" * 200}"', None),
        (NAME, f'name = "{"x" * 201}"', "name"),
        (NAME, 'name = "two\\nlines"', "name"),
        (NAME, 'name = "\\u202Egnp.exe"', "name"),
        (NAME, f'{NAME}\nstore = "{"x" * 1001}"', "store"),
        (GOALS, '["sigma_sd", "sigma_sd"]', "objectives"),
        (SPREAD, LEVELS % 1, "levels"),
        (SPREAD, LEVELS % 1001, "levels"),
        (SPREAD, "{ values = [30.0] }", None),
        (SPREAD, "{ values = [" + "30.0, " * 1001 + "] }", "values"),
        (SPREAD, "[20.0, nan]", "gauges.spread_deg"),
        (SPREAD, '["20", "50"]', "gauges.spread_deg"),
        ("[couplings]", "\n".join(["[fixed]", *(f"k{k} = 1.0" for k in range(201)), "[couplings]"]), "fixed"),
        ("[couplings]", "\n".join([*(f"k{k} = [1.0, 2.0]" for k in range(51)), "[couplings]"]), "free"),
    ],
)
def test_a_fault_of_a_study_file_is_one_line_with_file_and_key(study_file, old, new, said):
    path = study_file((old, new))
    if said is None:
        read_study(path)
    else:
        with pytest.raises(InputError, match=said) as refused:
            read_study(path)
        told = str(refused.value)
        assert "study.toml" in told and "\n" not in told and len(told) < 1000


@pytest.mark.parametrize("levels", [215, 216])
def test_the_product_of_a_grid_is_bounded(study_file, levels):
    """215**3 is just below ten million, 216**3 above."""
    skin = f'"shape.skin_mm" = {{ low = 2.9, high = 3.1, levels = {levels} }}\n[couplings]'
    outer = f'"outer.modulus_MPa" = {{ low = 0.1, high = 0.6, levels = {levels} }}'
    path = study_file(
        ("[couplings]", skin), (SPREAD, LEVELS % levels), (FREE, outer), ("designs = 12", 'kind = "grid"')
    )
    if levels > 215:
        with pytest.raises(InputError, match=f"number of designs of the grid must be .* got {levels**3}"):
            read_study(path)
    else:
        assert read_study(path).most_designs == sampling.count(read_study(path))[0] == levels**3


def test_a_study_makes_fingers(study_file):
    study = read_study(study_file())
    finger = study.finger_of({"outer.modulus_MPa": 0.4, "gauges.spread_deg": 30.0})
    assert (finger.outer.modulus, finger.inner.modulus) == (0.4, 0.1)
    assert [gauge.angle_deg for gauge in finger.gauges] == [-30, -15, 0, 15, 30]
    assert study.couplings and not study.outer and len(study.places.gauges(finger.shape)) == 17


def test_a_study_takes_what_the_finger_states(study_file, tmp_path):
    formula = '"inner.nu" = "outer.nu * shape.outer.x_mm / 24 - shape.bone.z_mm / 100"'
    study = read_study(study_file(("[couplings]", f"[couplings]\n{formula}")))
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


@pytest.mark.parametrize("share, verdict", [(1.099, "within 10 %"), (1.101, "off by +10 %"), (0.899, "off by -10 %")])
def test_a_prediction_is_confirmed_within_a_tenth(share, verdict):
    ones = np.ones((2, 3))
    one = Confirmed("f", {"S_d": 0.2 * share * ones}, {"S_d": 0.2 * ones}, DesignScene())
    assert one.sentence == f"f: S_d: predicted {0.2 * share:.3g}, calibrated 0.2 ({verdict})"


def test_the_grid_of_a_scene_extends_beyond_it():
    force, modulus = DesignScene((0.2, 0.8), (0.1, 0.4)).grid
    assert np.unique(force) == pytest.approx(np.geomspace(0.2 / 1.25, 0.8 * 1.25, 10))
    assert np.unique(modulus) == pytest.approx(np.geomspace(0.1 / 1.05, 0.4 * 1.05, 14))
    assert len(force) == len(modulus) == 140 and force[0] == force[13] < force[14] and modulus[0] < modulus[1]
    assert (
        DesignScene((0.2, 0.5)).swept(Finger.default())[0][-1] == pytest.approx(0.525)
        and DesignScene().swept(Finger.default())[0][-1] == 1.0
    )
    for parts in ({"forces": 2}, {"moduli": 40}):
        assert DesignScene(**parts).points[0][0] == pytest.approx(0.2)
    for name in ("samples", "gauge_noise_microstrain", "force_noise_N", "depth_noise_mm", "depth_mm", "place_mm"):
        with pytest.raises(InputError, match=name):
            DesignScene(**{name: 0})


def test_a_design_needs_two_gauges_that_differ_and_a_press_inside_the_model(made_up_geometry):
    places = Places.of(FINGER)
    geometry = made_up_geometry(with_sites(FINGER, places), places)
    row = Places.row(foil_of(FINGER.gauges))
    wide, middle = made_up_geometry(with_sites(FINGER, row), row), FINGER.gauges[2]
    for gauges in ((middle,), (middle, replace(middle, name="g9"))):
        with pytest.raises(InputError, match="S_d needs at least two gauges whose readings differ"):
            _ = DesignInScene(replace(FINGER, gauges=gauges), wide, DesignScene()).surfaces
    hard = DesignScene((0.2, 0.98), (0.05, 90.0))
    design = DesignInScene(FINGER, geometry, hard)
    force, modulus = hard.grid
    inside = geometry.ends[0].inside(force, modulus, *design.moduli)
    k = int(np.flatnonzero(~inside)[0])
    with pytest.raises(InputError, match=rf"contact patch or table\): {force[k]:.3g} N on {modulus[k]:.3g} MPa"):
        _ = design.ends


@pytest.mark.parametrize(
    "text, said",
    [
        ("[20.0, 30.0, 50.0]", r"must be \[low, high\] or a table, got"),
        ("{ low = 0.0, high = 50.0, log = true }", "log = true needs a range above 0, got 0.0 to 50.0"),
        ("{ low = 20.0 }", "empty range, 20.0 to None"),
        ("{ high = 20.0 }", "empty range, None to 20.0"),
        ("{ low = 20.0, high = 20.0 }", "empty range, 20.0 to 20.0"),
    ],
)
def test_a_range_that_is_none_is_refused(study_file, text, said):
    with pytest.raises(InputError, match=f"gauges.spread_deg.*{said}"):
        read_study(study_file((SPREAD, text)))


def test_ranges_are_even_or_logarithmic_as_stated(study_file):
    modulus, spread = read_study(
        study_file((SPREAD, "{ low = 20.0, high = 50.0, log = true, levels = 3 }"),
                   (FREE, '"outer.modulus_MPa" = { low = 0.1, high = 0.6, log = false }'))
    ).free  # fmt: skip
    assert spread.log and spread.grid == pytest.approx([20, 1000**0.5, 50]) and not modulus.log
    assert modulus.grid == pytest.approx(np.linspace(0.1, 0.6, 5))
    _, some = read_study(study_file((SPREAD, "{ values = [40.0, 20.0, 30.0] }"))).free
    assert (some.low, some.high, some.levels, some.grid) == (20.0, 40.0, 3, [40.0, 20.0, 30.0])


def test_values_are_held_to_their_ranges_apart_from_rounding(study_file):
    study = read_study(study_file())
    for value, ok in ((50 * (1 + 0.9e-9), True), (50 * (1 + 1.1e-9), False), (20 - 45e-9, True), (20 - 55e-9, False)):
        free = {"outer.modulus_MPa": 0.3, "gauges.spread_deg": value}
        if ok:
            study.check_free(free)
        else:
            with pytest.raises(InputError, match=f"spread_deg = {value:g} is outside the study's 20 to 50"):
                study.check_free(free)
    with pytest.raises(InputError, match="are not those of the study, outer.modulus_MPa, gauges.spread_deg"):
        study.check_free({"outer.modulus_MPa": 0.3})
    limited = replace(study, limits={"sigma_sd": Limit(0.1, 0.3)})
    assert [limited.feasible({"sigma_sd": sigma}) for sigma in (0.05, 0.1, 0.3, 0.4)] == [False, True, True, False]
    assert limited.asked == ("sigma_sd", "signal_over_noise")


def test_a_study_has_as_many_designs_as_it_says(study_file):
    for kind, designs, most in (("sobol", 3, 3), ("optimise", 3, 10), ("optimise", 33, 33), ("grid", 3, 25)):
        assert read_study(study_file(("designs = 12", f'kind = "{kind}"\ndesigns = {designs}'))).most_designs == most
    three = read_study(study_file((SPREAD, "{ values = [40.0, 20.0, 30.0] }"), ("designs = 12", 'kind = "grid"')))
    assert three.most_designs == 15
