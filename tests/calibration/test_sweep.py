"""The table of presses on a real coarse finger: nothing dropped, files there and back."""

from dataclasses import replace

import numpy as np
import pytest
from scaled_finger import scaled_finger

from papilla.calibration import DEFAULT_FORCES, DEFAULT_MODULI, Sweep, sweep
from papilla.calibration.fitting.sweep import SHOWN_PRESS, CalibrationRanges
from papilla.core.errors import FileFormatError, InputError
from papilla.core.tables import TableReader
from papilla.core.units import gf_to_newton
from papilla.fem import prepare, press
from papilla.logs import read_presses
from papilla.model.finger import SHIPPED_FINGERS, Bench, Finger
from papilla.model.specimen import Block, HalfSpace

MODULI, FORCES = [0.5, 0.025], [5.0, 0.1, 0.3]


@pytest.fixture(scope="module")
def reduced():
    """The default finger on a coarse mesh."""
    return prepare(Finger.default(), size_mm=2.8)


@pytest.fixture(scope="module")
def table(reduced):
    """Presses of which the heaviest on the softest specimen leaves the range of the model."""
    return sweep(reduced, MODULI, FORCES)


def test_every_press_is_a_row_and_a_failed_one_says_why(reduced, table):
    steps = []
    again = sweep(reduced, MODULI, FORCES, progress=steps.append)
    assert [(step.done, step.total) for step in steps] == [(k, 6) for k in range(1, 7)]
    np.testing.assert_array_equal(again.reading, table.reading)
    assert table.modulus_MPa.tolist() == [0.025] * 3 + [0.5] * 3 and table.force_N.tolist() == [0.1, 0.3, 5.0] * 2
    assert table.valid.tolist() == [True, True, False] * 2
    assert np.isnan(table.reading[2]).all() and np.isnan(table.sd_microstrain[2]) and not table.resolved[2]
    assert table.status[2] and table.status[2] != table.status[1] and "\n" not in table.status[2]
    assert table.sd_microstrain[table.valid] == pytest.approx(table.reading[table.valid].std(axis=1))


def test_a_row_is_the_press_that_papilla_press_makes(reduced, table):
    """With large strain and stick, which are known for this finger; S_d rises with force and with the modulus."""
    one = press(reduced, Block(0.5, 10.0), force=0.3, friction="stick", fidelity="contact")
    linear = sweep(reduced, [0.5], [0.3], friction="stick", large_strain=False)
    assert linear.reading[0] == pytest.approx(one.reading, rel=1e-9) or table.reading[4] == pytest.approx(one.reading)
    assert table.reading[4] == pytest.approx(linear.reading[0], rel=0.1) and table.friction == "stick"
    assert (table.sd_microstrain[3:5] > table.sd_microstrain[:2]).all()
    for name in ("sd_microstrain", "indentation_mm", "contact_area_mm2"):
        light, heavy, _ = getattr(table, name)[3:]
        assert 0 < light < heavy


def test_the_bench_or_the_caller_says_the_friction(reduced):
    free = sweep(reduced, [0.5], [0.3], friction=0.0)
    bench = sweep(prepare(replace(Finger.default(), bench=Bench(friction=0.0)), size_mm=2.8), [0.5], [0.3])
    stuck = sweep(reduced, [0.5], [0.3], friction="stick")
    assert (free.friction, free.friction_told, stuck.friction, stuck.friction_told) == (0.0, True, "stick", True)
    assert not sweep(reduced, [0.5], [0.3]).friction_told
    assert bench.friction_told and bench.reading == pytest.approx(free.reading)
    assert Sweep.from_arrays(stuck.to_arrays()).friction == "stick"
    assert not np.allclose(free.reading, stuck.reading, rtol=1e-3)


def test_a_specimen_stands_for_its_kind_with_every_modulus(reduced):
    of_kind = sweep(reduced, [0.2, 0.4], [0.3], HalfSpace(1.0, nu=0.4))
    made = sweep(reduced, [0.4, 0.2], [0.3], lambda modulus: HalfSpace(modulus, nu=0.4))
    np.testing.assert_array_equal(of_kind.reading, made.reading)
    assert of_kind.specimen == made.specimen == "HalfSpace(nu=0.4)"


@pytest.mark.parametrize(
    "moduli, forces, message",
    [
        ([0.1, -1], [0.1], "modulus \\(MPa\\) must be greater than 0, got -1"),
        ([0.1], [float("nan")], "force \\(N\\) must be finite"),
        ([0.1, 0.1], [0.1], "modulus \\(MPa\\) 0.1 occurs twice"),
        ([], [0.1], "at least one modulus"),
    ],
)
def test_bad_values_are_refused(reduced, moduli, forces, message):
    with pytest.raises(InputError, match=message):
        sweep(reduced, moduli, forces)


def test_csv_there_and_back_and_as_a_bench_log(reduced, table, tmp_path):
    path = tmp_path / "sweep.csv"
    table.to_csv(path)
    assert path.read_text().startswith("force_N,modulus_MPa,g1,g2,g3,g4,g5,sd_microstrain,indentation_mm,")
    with TableReader(path, lambda name: name != "status") as reader:
        columns = reader.whole().columns
    for name in ("force_N", "modulus_MPa", "sd_microstrain", "contact_area_mm2", "resolved"):
        np.testing.assert_array_equal(columns[name], getattr(table, name))
    np.testing.assert_array_equal(columns["g2"], table.reading[:, 1])
    sweep(reduced, [0.2, 0.5], [0.1, 0.3]).to_csv(path)
    assert len(read_presses(path)) == 4


@pytest.mark.parametrize("name", ["others", "force_N", "reading", "resolved"])
def test_arrays_that_do_not_fit_together_are_refused(made_up, name):
    arrays = made_up.to_arrays()
    for spoilt in (
        {key: array for key, array in arrays.items() if key != name},
        arrays | {name: np.array("{}") if name == "others" else arrays[name][:-1]},
    ):
        with pytest.raises(FileFormatError, match=f"a sweep.*({name}|status)"):
            Sweep.from_arrays(spoilt)


def test_the_default_moduli_hold_the_published_specimens():
    assert {0.089, 0.51, 0.72} <= set(DEFAULT_MODULI) and (min(DEFAULT_MODULI), max(DEFAULT_MODULI)) == (0.02, 5.0)
    assert (min(DEFAULT_FORCES), max(DEFAULT_FORCES)) == (0.05, 1.0)


def test_ranges_follow_the_finger():
    """Those of the default finger as they are, the same strains of another one to the rounding of the factors."""
    for name in SHIPPED_FINGERS:
        ranges = CalibrationRanges.of(Finger.load(name))
        assert (ranges.forces, ranges.moduli, ranges.shown) == (DEFAULT_FORCES, DEFAULT_MODULI, SHOWN_PRESS)
        assert ranges.to_json() == {} and CalibrationRanges.recorded({"name": name}) == ranges
    rng = np.random.default_rng(5)
    for _ in range(20):
        length, stress = np.exp(rng.uniform(np.log(0.3), np.log(3), 2)).tolist()
        ranges = CalibrationRanges.of(scaled_finger(Finger.default(), length, stress))
        assert CalibrationRanges.recorded(ranges.to_json()) == ranges
        scaled = (ranges.forces, DEFAULT_FORCES, length**2 * stress), (ranges.moduli, DEFAULT_MODULI, stress)
        for values, default, factor in scaled:
            relative = np.divide(values, default) / factor
            assert np.ptp(relative) < 1e-12 and 1 / 1.3 < relative[0] < 1.3


def test_a_finger_of_human_size_is_swept_by_a_few_gf():
    human = CalibrationRanges.of(scaled_finger(Finger.default(), 1 / 3, 1.0))
    assert human.forces[0] < gf_to_newton(2) < gf_to_newton(5) < human.forces[-1] < gf_to_newton(20)
    (low, high), _ = human.checked
    assert low < gf_to_newton(5) < high
