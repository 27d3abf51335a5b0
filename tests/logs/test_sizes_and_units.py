"""Factors of units, and what the size of a number says: each limit from both sides."""

import numpy as np
import pytest

from papilla.core.errors import FileFormatError, InputError
from papilla.core.units import gf_to_newton
from papilla.logs import read_presses, read_time_log, statistics
from papilla.logs.log_map import LOG_QUANTITIES, Column, LogMap, column_meant, split_unit
from papilla.logs.proposal import Guess, propose

GF = gf_to_newton(1.0)
LENGTHS = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1e3}
IN_PAPILLAS = {
    "t_s": {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "iso": 1.0},
    "force_N": {"mN": 1e-3, "N": 1.0, "kN": 1e3, "gf": GF, "g": GF, "kgf": 1e3 * GF},
    "torque_Nmm": {"Nmm": 1.0, "mNm": 1.0, "Ncm": 10.0, "Nm": 1e3},
    "position_mm": LENGTHS,
    "velocity_mm_s": {f"{unit}/s": factor for unit, factor in LENGTHS.items()},
    "modulus_MPa": {"Pa": 1e-6, "kPa": 1e-3, "MPa": 1.0, "GPa": 1e3},
    "sd_microstrain": {"ue": 1.0, "um/m": 1.0, "microstrain": 1.0, "m/m": 1e6, "strain": 1e6, "%": 1e4},
    "specimen": {"text": 1.0},
}
LIKE = {"tangential_N": "force_N", "modulus_sigma_MPa": "modulus_MPa", "g1": "sd_microstrain"}
LIKE |= dict.fromkeys(("indentation_mm", "thickness_mm", "radius_mm", "x_mm", "y_mm"), "position_mm")


@pytest.mark.parametrize("column", [*LOG_QUANTITIES, "g1"])
def test_each_unit_of_a_column_has_its_factor_and_is_known_from_a_name(column):
    for unit, factor in IN_PAPILLAS[LIKE.get(column, column)].items():
        assert Column("a", unit).factor(column) == pytest.approx(factor, rel=1e-12)
        assert split_unit(f"a [{unit}]") == ("a", unit)
    with pytest.raises(InputError, match="unit must be one of"):
        Column("a", "furlong").factor(column)


def test_units_have_several_spellings():
    spelt = {"N·mm": "Nmm", "N mm": "Nmm", "mm s^-1": "mm/s", "µm": "um", "μm": "um", "µε": "ue", "grams": "g"}
    spelt |= {"sec": "s", "ustrain": "microstrain", "µStrain": "microstrain"}
    assert {text: split_unit(f"x ({text})")[1] for text in spelt} == spelt
    spelt = {"force / gf": ("force", "gf"), "t_ms": ("t", "ms"), "a_mm_s": ("a", "mm/s"), "force_n": ("force_n", None)}
    assert {name: split_unit(name) for name in spelt} == spelt
    meant = {"ch999": "g999", "ch1000": None, "Strain 3": "g3", "SG_2": "g2", "ch0": None, "Load": "force_N", "a": None}
    assert {name: column_meant(name) for name in meant} == meant


@pytest.fixture
def file(tmp_path):
    def write(content: str, name: str = "log.csv"):
        (tmp_path / name).write_text(content)
        return tmp_path / name

    return write


@pytest.mark.parametrize(
    "name, largest, unit",
    [
        ("force", 19.9, "N"), ("force", 20.1, "gf"), ("shear", 19.9, "N"), ("shear", 20.1, "gf"), ("depth", 14.9, "mm"),
        ("depth", 15.1, "um"), ("E", 19.9, "MPa"), ("E", 20.1, "kPa"), ("E", 19_900, "kPa"), ("E", 20_100, "Pa"),
        ("speed", 0.49, "m/s"), ("speed", 0.51, "mm/s"), ("speed", 0.0, "mm/s"), ("weg", 1e6, "mm"),
        ("ch", 0.049, "strain"), ("ch", 0.051, "microstrain"), ("ch", 1499, "microstrain"), ("ch", 1500, "counts"),
        ("ch", 1500.5, "microstrain"),
    ],
)  # fmt: skip
def test_a_unit_is_proposed_by_the_largest_number(file, name, largest, unit):
    _, found = propose(file(f"t_s,{name}\n0,{-largest}\n1,0\n")).guesses
    assert (found.name, found.unit) == (name, unit) and found.meant
    assert any(f"{largest:{form}}" in found.reason for form in (".2g", ".3g", ".0f"))


@pytest.mark.parametrize(
    "step, unit",
    [
        (0.124, "s"), (0.126, "ms"), (1.7e-5, "s"), (1.6e-5, "none"), (1, "ms"), (124, "ms"), (126, "us"), (1000, "us"),
        (0, "ms"), (124e3, "us"), (126e3, "ns"), (124e6, "ns"), (126e6, "none"),
    ],
)  # fmt: skip
def test_a_unit_of_time_is_proposed_that_gives_a_rate_between_8_hz_and_60_khz(file, step, unit):
    found, _ = propose(file("time,ch1\n" + "".join(f"{k * step},{k}\n" for k in (0, 1, 1, 2, 3, 9)))).guesses
    step = step or 1  # Of equal times
    if unit == "none":
        assert (found.unit, found.reason) == ("s", f"its name; steps of {step:g}: a rate that no unit explains")
        return
    rate_Hz = 1 / (step * IN_PAPILLAS["t_s"][unit])
    assert (found.unit, found.reason) == (unit, f"its name; steps of {step:g} are {rate_Hz:.4g} Hz")


def test_a_proposed_map_has_examples_of_an_amplifiers_numbers(file):
    path = file("t_s,ch1 [mV/V],ch2 [V],ch3 [counts],ch4 [ue]\n0,1,2,3,4\n1,1,2,3,4\n")
    read = LogMap.load(file(propose(path).to_toml(), "m.toml")).columns
    half_bridge = 4 / 2.0 * 1e6
    factors = {"g1": 1e-3 * half_bridge, "g2": half_bridge / 5, "g3": half_bridge / 5 * 10 / 2**16, "g4": 1.0}
    assert {name: read[name].factor(name) for name in factors} == pytest.approx(factors)
    assert [read[f"g{k}"].excitation_V for k in (1, 2, 3, 4)] == [None, 5.0, 5.0, None]
    assert [read[f"g{k}"].bits for k in (1, 2, 3, 4)] == [None, None, 16, None]


def test_comments_of_a_map_end_after_200_columns_and_characters(file):
    names = ["y" * 200, "z" * 201, *(f"odd{k}q" for k in range(201))]
    path = file(f"t_s,ch1,{','.join(names)}\n" + 2 * f"1,2{',3' * len(names)}\n")
    *_, last = [line for line in propose(path).to_toml().splitlines() if line.startswith("# not used")]
    listed = last.removeprefix("# not used, because they were not recognised: ").split(", ")
    assert listed == [names[0], "z" * 200 + "...", *names[2:200], "and 3 more"]


@pytest.mark.parametrize("lines, found", [(0, True), (59, True), (60, False)])
def test_the_header_is_looked_for_in_60_lines(file, lines, found):
    path = file("# rig\n" * lines + "t_s,ch1\n0,1\n1,2\n")
    if found:
        assert propose(path).header_line == lines + 1
    else:
        with pytest.raises(FileFormatError, match="no table in its first 60 lines"):
            propose(path)


def test_a_column_alone_may_be_a_table_and_one_of_numbers_beside_text_is_none(file):
    assert [guess.meant for guess in propose(file("ch1\n1\n2\n")).guesses] == ["g1"]
    with pytest.raises(FileFormatError, match="no row of names above rows of numbers"):
        propose(file("note,ch1\na,1\nb,2\n"))


@pytest.mark.parametrize(
    "name, silent, largest, remark, unit",
    [
        ("g1", 0.051, 0.049, "no reading is above 0.049: this looks like strain, not microstrain", "strain"),
        ("g1", 2999, 3000, "readings are whole numbers up to 3000: this looks like counts", "counts"),
        ("g1", 3000.5, 3001, "readings are whole numbers up to 3001: this looks like counts", "counts"),
        ("g1", 0.0, 3001, "readings are whole numbers up to 3001: this looks like counts", "counts"),
        ("force_N", 19.9, 20.1, "force_N comes to 20.1: this looks like gf", "gf"),
        ("tangential_N", 19.9, 20.1, "tangential_N comes to 20.1: this looks like gf", "gf"),
        ("velocity_mm_s", 0.51, 0.49, "velocity_mm_s stays below 0.49: this looks like m/s", "m/s"),
        ("velocity_mm_s", 0.0, 0.4, "velocity_mm_s stays below 0.4: this looks like m/s", "m/s"),
    ],
)
def test_the_size_of_a_logs_numbers_is_remarked_on(name, silent, largest, remark, unit):
    frame = {"t_s": [0.0, 1.0], "g1": [1.5, 2.0], "position_mm": [1e5, 0.0]}
    assert read_time_log(frame | {name: [-silent, 0.0]}).report.sizes == ()
    (note,) = read_time_log(frame | {name: [-largest, 0.0]}).report.sizes
    assert note == f'{remark} (if so: --map with {name} = {{ column = "{name}", unit = "{unit}" }})'


@pytest.mark.parametrize(
    "name, silent, told, other, remark",
    [
        ("force_N", 19.9, 20.1, 1, "force_N comes to 20.1: this looks like gf"),
        ("g1", 0.05, 0.04, 0.01, "no reading is above 0.04"),
        ("modulus_MPa", 19.9, 20.1, 50, "no modulus_MPa is below 20.1: this looks like kPa"),
        ("indentation_mm", 14.9, 15.1, 1, "indentation_mm comes to 15.1: this looks like micrometres"),
    ],
)  # fmt: skip
def test_the_size_of_numbers_of_presses_is_remarked_on(name, silent, told, other, remark):
    usual = {"force_N": [1.0, 1.1], "modulus_MPa": [0.5, 30.0], "g1": [1.5, 2.0], "indentation_mm": [1.0, 2.0]}
    assert read_presses(usual | {name: [other, silent]}).sizes == ()
    (note,) = read_presses(usual | {name: [told, other]}).sizes
    assert note.startswith(remark) and f" (if so: --map with {name} = " in note


def test_steps_of_a_time_log_have_limits():
    def read(*times):
        return read_time_log({"t_s": times, "g1": np.arange(len(times)) + 0.5})

    for step in (1.1e-7, 0.9e5):
        assert read(0, step).sample_rate_Hz == pytest.approx(1 / step)
    for step in (0.9e-7, 1.1e5):
        with pytest.raises(FileFormatError, match="are these times in s"):
            read(0, step)
    assert [read(0, 1, 2, 3, 3 + gap).report.gaps for gap in (1.49, 1.51)] == [0, 1]
    # Half of the rows share their time with the row before: a fault; two thirds: packets of three
    assert read(*np.repeat(np.arange(10.0), 2)).sample_rate_Hz == pytest.approx(1)
    packets = read(*np.repeat(np.arange(100.0), 3))
    assert packets.sample_rate_Hz == pytest.approx(3) and "taken as 3 Hz, spread evenly" in packets.report.notes[0]


@pytest.mark.parametrize("key, limits", [("header_line", (1, 1000)), ("speed_mm_s", (-1e6, 1e6))])
def test_both_limits_of_a_maps_numbers_are_taken(key, limits):
    for limit, beyond in zip(limits, (-1, 1), strict=True):
        assert getattr(LogMap(**{key: limit}), key) == limit
        with pytest.raises(InputError, match=f"{key} must lie between"):
            LogMap(**{key: limit + beyond})
    assert LogMap(air_s=(-1e11, 1e11)).air_s == (-1e11, 1e11)
    for air_s in ((-1.01e11, 0.0), (0.0, 1.01e11), (1.0, 1.0)):
        with pytest.raises(InputError, match="air_s must"):
            LogMap(air_s=air_s)


def test_half_a_million_numbers_are_exact_and_groups_a_ten_thousandth_wide():
    rng, kept = np.random.default_rng(0), statistics.Magnitudes()
    values = rng.lognormal(size=2**19 + 1)
    kept.add(values[1:])
    assert kept.median() == np.median(values[1:])
    kept.add(values[:1])
    assert kept.median() == pytest.approx(np.median(values), rel=2**-14) and kept.median() != np.median(values)
    parts = statistics.Magnitudes(kept=100_000)
    assert np.isnan(parts.median())
    for part in np.array_split(values, 50):
        parts.add(part)
    assert parts.median() == pytest.approx(np.median(values), rel=1e-4)
    assert parts.split(2.0) == pytest.approx((values[values <= 2].mean(), (values > 2).sum()), rel=1e-3)
    grouped = statistics.Magnitudes(kept=0)
    grouped.add(np.array([1.0, 1 + 2**-15, 1 + 1.9 * 2**-15, 1 + 2**-14, 1 + 2**-14]))
    assert grouped.split(1 + 1.5 * 2**-15) == (pytest.approx(1 + 2.9 / 3 * 2**-15, rel=1e-9), 2)
    assert grouped.median() == pytest.approx(1 + 2.9 / 3 * 2**-15, rel=1e-9)


@pytest.mark.parametrize("size", [1, 2, 3, 50])
def test_noise_block_by_block_is_that_of_all_rows(size):
    rows = np.random.default_rng(size).standard_normal((301, 2)) * [1.0, 5.0]
    noise = statistics.WhiteNoise()
    for first in range(0, len(rows), size):
        noise.add(rows[first : first + size])
    second = np.abs(rows[2:] - 2 * rows[1:-1] + rows[:-2])
    # The second difference of white noise has 6 times its variance; 0.6745 is the median of |N(0, 1)|
    assert noise.sigma == pytest.approx(np.median(second, axis=0) / np.sqrt(6) / 0.67448975, rel=1e-7)


@pytest.mark.parametrize("count", [1999, 2000, 10_000])
def test_a_thinned_log_has_a_thousand_to_two_thousand_bins(count):
    thinned = statistics.Thinned()
    thinned.add(np.arange(float(count))[:, None])
    assert 1000 <= len(thinned.low) < 2000 and (thinned.high - thinned.low == round(count / len(thinned.low)) - 1).all()


# ---- What a proposed map says of names


@pytest.mark.parametrize(
    "name, meant",
    [
        ("Kraft Sensor [N]", "force_N"), ("shear load", "force_N"), ("load shear", "tangential_N"),
        ("v", "velocity_mm_s"),
        ("rail encoder (cm)", "position_mm"), ("odd [um/s]", "velocity_mm_s"), ("odd [cm/s]", "velocity_mm_s"),
        ("odd [ue]", "g1"), ("odd [um/m]", "g1"), ("odd (mV/V)", "g1"), ("finger strain", "g1"), ("gauges 7", "g7"),
        ("force [mm]", ""), ("odd [N]", ""), ("odd", ""), ("x", "x_mm"), ("sd", "sd_microstrain"),
        ("moment", "torque_Nmm"),
        ("stage speed (mm/s)", "velocity_mm_s"), ("load_cell", "force_N"), ("finger strain 4", "g4"), ("Fz (V)", ""),
        ("AIN", ""), ("channel_x 2", "g2"), ("position_mm", "position_mm"), ("radius [cm]", "radius_mm"),
    ],
)  # fmt: skip
def test_a_column_is_known_by_its_name_a_word_of_it_or_its_unit(file, name, meant):
    _, found, words = propose(file(f"t_s,{name},note\n0,1,a\n1,2,b\n")).guesses
    assert words == Guess("note", "", "", "no numbers") and found.name == name
    assert found.meant == meant and (found.reason == "unknown name") == (not meant)


def test_gauges_are_numbered_and_a_meaning_is_given_once(file):
    names = "t_s,ch,ch 3,strain,Fz [N],load [N],ft [N],torque [Nm],stamp q"
    guesses = propose(file(f"{names}\n0,1,1,1,1,1,1,1,1\n1,2,2,2,2,2,2,2,2\n")).guesses
    assert [guess.meant for guess in guesses] == ["t_s", "g1", "g3", "g2", "force_N", "", "tangential_N", "", ""]
    assert guesses[5].reason == "force_N is another column already, or not needed beside it"
    from_0 = propose(file("t_s,ch2,ch0,ch1\n0,1.5,2,3\n0.1,2.5,3,4\n")).guesses
    assert {guess.name: guess.meant for guess in from_0} == {"t_s": "t_s", "ch0": "g1", "ch1": "g2", "ch2": "g3"}


@pytest.mark.parametrize(
    "names, asked",
    [
        ("t_s,g1,force_N,velocity_mm_s", ()), ("t_s,g1,force_N,position_mm", ()), ("modulus_MPa,g1,force_N", ()),
        ("note,g1,force_N,position_mm", ("seems to be a time",)), ("t_s,force_N,position_mm", ("to be a gauge",)),
        ("t_s,g1,position_mm", ("without one there is no modulus",)), ("t_s,g1,force_N", ("state speed_mm_s",)),
        ("t_s,g1,force_N,position_mm,torque_Nmm", ("give --lever-mm",)),
        ("t_s,ch1 (V),force_N,position_mm", ("numbers of the gauges' amplifier",)),
        ("t_s,ch1 (counts),force_N,position_mm", ("numbers of the gauges' amplifier", "state air_s")),
    ],
)  # fmt: skip
def test_what_no_column_gives_is_asked(file, names, asked):
    rows = "".join(",".join([str(k / 100)] * (names.count(",") + 1)) + "\n" for k in range(4))
    questions = propose(file(f"{names}\n{rows}")).open_questions
    assert len(questions) == len(asked) and all(part in one for part, one in zip(asked, questions, strict=True))


# ---- Presses


@pytest.mark.parametrize("sd, off", [(200, 2), (10, 0.5)])
def test_a_stated_sd_may_be_off_by_a_hundredth_or_half_a_microstrain(sd, off):
    for sign in (-1, 1):
        frame = {"force_N": [1.0, 2.0], "modulus_MPa": [1.0, 1.0], "g1": [0, 0], "g2": [2 * sd, 2 * sd]}
        assert read_presses(frame | {"sd_microstrain": [sd, sd + 0.99 * sign * off]}).sd_microstrain[1] == sd
        with pytest.raises(FileFormatError, match=f"line 1.* is not the population standard .* of the gauges, {sd}"):
            read_presses(frame | {"sd_microstrain": [sd, sd + 1.01 * sign * off]})


@pytest.mark.parametrize("end, closed", [(0.199, True), (0.201, False)])
def test_a_force_that_rises_by_half_a_per_cent_is_held_and_one_that_returns_to_a_fifth_closes_a_loop(end, closed):
    """The work is the area under the force over the depth: trapezoids."""
    force, depth = [0.5, 1.0, 1.0049, 1.0051 * 1.0049, end * 1.0051 * 1.0049], [0.1, 0.2, 0.21, 0.3, 0.2]
    frame = {"t_s": range(7), "force_N": [*force, 0.3, 0.4], "modulus_MPa": [0.5] * 5 + [0.9] * 2}
    frame |= {"g1": range(7), "indentation_mm": [*depth, 1.0, 2.0]}
    found = read_presses(frame)
    assert found.t_s.tolist() == [0, 1, 3, 5, 6]
    assert len(found.loops) == closed and len(read_presses(frame, whole=True)) == 7
    assert "2 of 7 rows hold or unload the finger (t_s)" in found.notes[0] and len(found.notes) == 1 + closed
    for loop in found.loops:
        top = force[3]
        taken = 0.75 * 0.1 + 0.5 * (1 + 1.0049) * 0.01 + 0.5 * (1.0049 + top) * 0.09
        assert loop.lost_N_mm == pytest.approx(taken - 0.5 * (top + end * top) * 0.1) and loop.force_N == top
        assert f"a loop to {top:.3g} N on 0.5 MPa lost {loop.lost_N_mm:.3g} N mm" in found.notes[1]
        assert loop.share == pytest.approx(loop.lost_N_mm / taken) and loop.modulus_MPa == 0.5
