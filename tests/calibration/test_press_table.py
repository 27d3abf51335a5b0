"""The table of presses: nothing dropped, files there and back."""

from types import SimpleNamespace

import numpy as np
import pytest

from papilla.calibration import DEFAULT_FORCES, DEFAULT_MODULI, Sweep, sweep
from papilla.calibration.fitting import sweep as press_table
from papilla.core.errors import ContactRangeError, FileFormatError, InputError
from papilla.core.tables import TableReader
from papilla.fem.pressing import fidelity
from papilla.logs import read_presses
from papilla.model.finger import Bench
from papilla.model.specimen import HalfSpace

REDUCED = SimpleNamespace(
    gauge_names=("g1", "g2"), finger_name="f", finger_sha256="a", mesh_sha256="b", mesh_size_mm=0.7, at=(1.0, 0.0),
    bench=Bench(),
)  # fmt: skip


@pytest.fixture
def pressed(monkeypatch):
    """The calls that a sweep makes; a press on less than 0.1 MPa by more than 0.5 N leaves the patch."""
    calls = []

    def press(reduced, specimen, *, force, fidelity, friction):
        calls.append((specimen, force, fidelity))
        assert friction in (0, "stick")
        if specimen.modulus < 0.1 and force > 0.5:
            raise ContactRangeError("the contact reaches the rim of its patch")
        reading = np.array([force, -force]) * 100 * specimen.modulus
        return SimpleNamespace(
            reading=reading, sd=reading.std(), indentation=force, contact_area=1.0, peak_pressure=0.1,
            resolved=force > 0.2, status="fine", active=np.array([force]), friction=float(friction != 0),
        )  # fmt: skip

    monkeypatch.setattr(fidelity, "press", press)
    return calls


def test_the_default_table_is_wide_and_holds_the_published_specimens():
    assert len(DEFAULT_MODULI) >= 12 and len(DEFAULT_FORCES) >= 20
    assert (min(DEFAULT_MODULI), max(DEFAULT_MODULI)) == (0.02, pytest.approx(5.0))
    assert (min(DEFAULT_FORCES), max(DEFAULT_FORCES)) == (0.05, pytest.approx(1.0))
    assert {0.089, 0.51, 0.72} <= set(DEFAULT_MODULI)


def test_every_press_is_a_row_and_a_failed_one_says_why(pressed):
    seen = []
    table = sweep(REDUCED, [0.5, 0.05], [1.0, 0.1, 0.3], progress=lambda done, total: seen.append((done, total)))
    assert len(table) == 6 and seen[-1] == (6, 6)
    assert table.valid.tolist() == [True, True, False, True, True, True]
    assert table.status[2] == "the contact reaches the rim of its patch"
    assert np.isnan(table.reading[2]).all() and np.isnan(table.sd_microstrain[2])
    assert table.modulus_MPa.tolist() == [0.05] * 3 + [0.5] * 3
    assert table.force_N[:3].tolist() == [0.1, 0.3, 1.0]
    assert table.resolved.tolist() == [False, True, False, False, True, True]
    assert table.specimen == "Block(thickness=10.0, nu=0.495, bonded=True)"


def test_presses_are_on_one_rung_and_begin_with_the_hardest(pressed):
    table = sweep(REDUCED, [0.2, 0.5], [0.1, 0.3], specimen=HalfSpace)
    assert {fidelity for _, _, fidelity in pressed} == {"contact"}
    assert [force for _, force, _ in pressed] == [0.3, 0.1] * 2 and table.force_N.tolist() == [0.1, 0.3] * 2
    assert all(isinstance(specimen, HalfSpace) for specimen, *_ in pressed)


def test_friction_reaches_every_press_and_the_label(pressed):
    assert sweep(REDUCED, [0.2], [0.1, 0.3]).friction == 0
    stuck = sweep(REDUCED, [0.2], [0.1, 0.3], friction="stick")
    assert stuck.friction == "stick" and Sweep.from_arrays(stuck.to_arrays()).friction == "stick"


def test_the_table_says_whether_friction_was_said_and_the_bench_says_it_too(pressed):
    for options, bench, told in (
        ({}, Bench(), False),
        ({"friction": 0.0}, Bench(), True),
        ({}, Bench(friction=0.0), True),
    ):
        found = sweep(SimpleNamespace(**(vars(REDUCED) | {"bench": bench})), [0.2], [0.1], **options)
        assert found.friction_told is told and found.friction == 0


def test_a_specimen_stands_for_its_kind_with_every_modulus(pressed):
    of_kind = sweep(REDUCED, [0.2, 0.4], [0.1, 0.3], HalfSpace(1.0, nu=0.4))
    made = sweep(REDUCED, [0.2, 0.4], [0.1, 0.3], lambda modulus: HalfSpace(modulus, nu=0.4))
    assert [call[0] for call in pressed[:4]] == [HalfSpace(0.2, 0.4)] * 2 + [HalfSpace(0.4, 0.4)] * 2
    assert of_kind.specimen == made.specimen == "HalfSpace(nu=0.4)"
    np.testing.assert_array_equal(of_kind.reading, made.reading)


@pytest.mark.parametrize(
    "moduli, forces, message",
    [
        ([0.1, -1], [0.1], "modulus \\(MPa\\) must be greater than 0, got -1"),
        ([0.1], [float("nan")], "force \\(N\\) must be finite"),
        ([0.1, 0.1], [0.1], "modulus \\(MPa\\) 0.1 occurs twice"),
        ([], [0.1], "at least one modulus"),
    ],
)
def test_bad_values_are_refused(pressed, moduli, forces, message):
    with pytest.raises(InputError, match=message):
        sweep(REDUCED, moduli, forces)
    assert pressed == []


def test_csv_there_and_back_and_as_a_bench_log(pressed, tmp_path):
    table = sweep(REDUCED, [0.05, 0.5], [0.1, 0.3, 1.0])
    path = tmp_path / "sweep.csv"
    table.to_csv(path)
    header = path.read_text().splitlines()[0].split(",")
    assert header[:6] == ["force_N", "modulus_MPa", "g1", "g2", "sd_microstrain", "indentation_mm"]
    with TableReader(path, lambda name: name != "status") as reader:
        written = reader.whole()
    for name in ("force_N", "modulus_MPa", "sd_microstrain", "contact_area_mm2", "resolved"):
        np.testing.assert_array_equal(written.columns[name], getattr(table, name))
    np.testing.assert_array_equal(written.columns["g2"], table.reading[:, 1])
    sweep(REDUCED, [0.2, 0.5], [0.1, 0.3]).to_csv(path)
    assert len(read_presses(path)) == 4


def test_arrays_there_and_back(made_up):
    back = Sweep.from_arrays(made_up.to_arrays())
    np.testing.assert_array_equal(back.reading, made_up.reading)
    assert (back.status, back.specimen, back.mesh_size_mm) == (made_up.status, made_up.specimen, made_up.mesh_size_mm)


def test_the_repr_is_short(made_up):
    assert repr(made_up) == "<Sweep of made up: 900 presses, 0.05-1 N, 0.02-5 MPa>"


@pytest.mark.parametrize("name", ["others", "force_N", "reading", "resolved"])
def test_arrays_that_do_not_fit_together_are_refused(made_up, name):
    arrays = made_up.to_arrays()
    for spoilt in (
        {key: array for key, array in arrays.items() if key != name},
        arrays | {name: np.array("{}") if name == "others" else arrays[name][:-1]},
    ):
        with pytest.raises(FileFormatError, match=f"a sweep.*({name}|status)"):
            Sweep.from_arrays(spoilt)


@pytest.mark.parametrize(
    "known, curvature, answer",
    [(True, (0.0, 0.0), "more"), (True, (0.0, 0.0), None), (False, (0.0, 0.0), "same"), (True, (0.2, 0.0), "same")],
)
def test_a_press_is_corrected_where_large_strain_is_known_and_the_specimen_flat(monkeypatch, known, curvature, answer):
    found, specimen, asked = SimpleNamespace(friction=0.4), SimpleNamespace(curvature=curvature), []
    monkeypatch.setattr(
        press_table, "is_known", lambda reduced, friction: known and (reduced, friction) == (REDUCED, 0.4)
    )
    monkeypatch.setattr(press_table, "including_large_strain", lambda *parts: asked.append(parts) or answer)
    if answer is None:
        with pytest.raises(ContactRangeError, match="outside of the measured range"):
            press_table.corrected(REDUCED, specimen, found)
    else:
        assert press_table.corrected(REDUCED, specimen, found) is (found if answer == "same" else answer)
    assert asked == ([] if answer == "same" else [(REDUCED, specimen, found)])
