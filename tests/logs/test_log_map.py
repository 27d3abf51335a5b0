"""Logs as labs write them: units in names, a map, a proposed map, and one clear line for what does not fit."""

import datetime
import decimal
import gzip
from pathlib import Path

import numpy as np
import pytest

from papilla.core.errors import FileAccessError, FileFormatError, InputError, MemoryEstimateError
from papilla.core.units import gf_to_newton
from papilla.logs import TimeLogFile, read_presses, read_time_log
from papilla.logs.frames import estimates_writer
from papilla.logs.log_map import CHANNEL_BOUNDS, Column, LogMap
from papilla.logs.proposal import propose

GF = gf_to_newton(1.0)


@pytest.fixture
def file(tmp_path):
    def write(content: str, name: str = "log.csv"):
        path = tmp_path / name
        path.write_bytes(gzip.compress(content.encode()) if name.endswith(".gz") else content.encode())
        return path

    return write


def test_columns_with_their_unit_need_no_map(file):
    found = read_time_log(file("t_ms,g1,Fz [gf],speed_m_s,room\n0,10,50,0.02,21\n2,12,51,0.02,21\n4,14,52,0.02,21\n"))
    np.testing.assert_allclose(found.t_s, [0, 0.002, 0.004])
    np.testing.assert_allclose(found.force_N, np.array([50, 51, 52]) * GF)
    np.testing.assert_allclose(found.velocity_mm_s, 20)
    said = "columns by its name: t_ms is t_s in ms, Fz [gf] is force_N in gf, speed_m_s is velocity_mm_s in m/s"
    assert said in found.report.notes and "ignored columns: room" in found.report.notes


def test_units_may_stand_in_a_row_of_their_own(file):
    rows = "Time;Fz;strain 1;room\n[ms];[gf];[µm/m];\n0;50,5;1,5;21\n2;51;2,5;21\n4;52;x;21\n"
    with pytest.raises(FileFormatError, match=r"line 5, column strain 1 \[µm/m\]: expected a number, got 'x'"):
        read_time_log(file(rows))
    found = read_time_log(file(rows.replace(";x;", ";3;")))
    np.testing.assert_allclose(found.t_s, [0, 0.002, 0.004])
    np.testing.assert_allclose(found.force_N, np.array([50.5, 51, 52]) * GF)
    np.testing.assert_array_equal(found.readings[:, 0], [1.5, 2.5, 3])
    said = "columns by its name: Time [ms] is t_s in ms, Fz [gf] is force_N in gf, strain 1 [µm/m] is g1"
    assert said in found.report.notes and "ignored columns: room" in found.report.notes


def test_a_unit_below_a_name_with_a_unit_counts(file):
    found = read_time_log(file("t_s,force_N,g1\ns,gf,ue\n0,50,2\n1,50,3\n"))
    np.testing.assert_allclose(found.force_N, 50 * GF)
    assert "columns by its name: t_s [s] is t_s, force_N [gf] is force_N in gf, g1 [ue] is g1" in found.report.notes


@pytest.mark.parametrize("name", ["log.csv", "log.csv.gz"])
def test_semicolons_and_decimal_commas_are_read_and_told(file, name):
    found = read_time_log(file("t_s;g1;force_N\n0,000;1,5;0,1\n0,001;2,5;0,2\n0,002;;0,3\n", name))
    np.testing.assert_array_equal(found.readings[:, 0], [1.5, 2.5, np.nan])
    assert found.force_N.tolist() == [0.1, 0.2, 0.3]
    assert "cells are separated by semicolons, decimal commas" in found.report.notes


def test_a_bridge_in_counts_becomes_strain(file, tmp_path):
    path = file("time;Fz;ch1;ch2\n2026-05-04T12:00:00.000;100;1000;-7\n2026-05-04T12:00:00.010;200;2000;0\n")
    bridge = {"gauge_factor": 2.0, "excitation_V": 2.5, "amplification": 500.0, "bits": 16, "span_V": 5.0}
    log_map = LogMap(
        {
            "t_s": Column("time", "iso"),
            "force_N": Column("Fz", "gf"),
            "g1": Column("ch1", "counts", **bridge),
            "g2": Column("ch2", "mV/V", gauge_factor=2.0, active_arms=2),
        },
        speed_mm_s=40.0,
    )
    found = read_time_log(path, log_map=log_map)
    np.testing.assert_allclose(found.t_s, [0, 0.01])
    # 1000 counts are 76.3 mV behind the amplifier, 61.0 uV/V of the bridge, and 4 / 2 of that as strain
    np.testing.assert_allclose(found.readings[:, 0], np.array([1, 2]) * 1000 * 5 / 2**16 / 500 / 2.5 * 4 / 2 * 1e6)
    np.testing.assert_allclose(found.readings[:, 1], [-7e-3 * 4 / (2 * 2) * 1e6, 0])
    np.testing.assert_allclose(found.velocity_mm_s, 40)


def test_a_map_beside_the_log_is_taken_and_told_and_air_is_the_zero(file):
    file('air_s = [0.0, 0.015]\n[columns]\ng1 = { column = "a", unit = "strain" }\n', "log_map.toml")
    found = read_time_log(file("t_s,a,force_N\n0,1e-6,0.1\n0.01,3e-6,0.1\n0.02,9e-6,0.5\n"))
    np.testing.assert_allclose(found.readings[:, 0], [-1, 1, 7])
    np.testing.assert_allclose(found.force_N, [0, 0, 0.4])
    assert found.report.notes[:2] == (
        "columns by log_map.toml: a is g1 in strain",
        "gauges and forces count from their mean over 0 to 0.015 s, in the air",
    )


@pytest.mark.parametrize(
    "text, message",
    [
        ("speed_mms = 3", "unknown key speed_mms; did you mean speed_mm_s?"),
        ('[columns]\nt_s = { colum = "a", unit = "s" }', "did you mean column?"),
        ('[columns]\nt_s = { column = "a", unit = "S" }', "unit must be one of s, ms, us, ns, min, iso, got 'S'"),
        ('[columns]\nforse_N = { column = "a", unit = "N" }',
         "columns.forse_N is no column of papilla; did you mean force_N"),
        ('[columns]\ng1 = { column = "a", unit = "mV/V" }', "columns.g1: a gauge in mV/V needs gauge_factor"),
        ('[columns]\ng1 = { column = "a", unit = "counts", gauge_factor = 2 }', "needs excitation_V"),
        ('[columns]\ng1 = { column = "a", unit = "V", gauge_factor = -2 }', "gauge_factor must lie between 0.1 and"),
        (f"header_line = 0x{'f' * 10**5}", "a whole number is too long"),
        ('[columns]\ng10000 = { column = "a", unit = "ue" }', "columns.g10000 is no column of papilla"),
        (f'[columns]\ng1 = {{ column = "{"x" * 1001}", unit = "ue" }}', "column has 1001 characters"),
        (f'[columns]\ng1 = {{ topic = "{"x" * 1001}", column = "x", unit = "ue" }}', "topic has 1001 characters"),
        (f'[columns]\ng1 = {{ column = "x", unit = "{"u" * 10**5}" }}', "unit must be one of"),
        (f'[columns]\n{"y" * 10**5} = {{ column = "x", unit = "ue" }}', "is no column of papilla"),
        ("[columns", "is not valid TOML"),
        ('decimal = "x"', 'decimal must be "." or ","'),
    ],
)  # fmt: skip
def test_a_bad_map_is_one_line(file, text, message):
    path = file(text, "m.toml")
    with pytest.raises(FileFormatError) as caught:
        LogMap.load(path)
    assert message in str(caught.value) and str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)


@pytest.mark.parametrize("name", CHANNEL_BOUNDS)
@pytest.mark.parametrize("side", [0, 1])
def test_numbers_of_a_bridge_are_bounded(file, name, side):
    """At the bound a map is read; a hundred times beyond, and for bits at once, it is one line."""
    bound = CHANNEL_BOUNDS[name][side]
    numbers = {"gauge_factor": 2.0, "excitation_V": 2.5, "bits": 16, "span_V": 5.0}

    def written(value):
        keys = ", ".join(f"{key} = {number}" for key, number in (numbers | {name: value}).items())
        return file(f'[columns]\ng1 = {{ column = "a", unit = "counts", {keys} }}\n', "m.toml")

    assert np.isfinite(LogMap.load(written(bound)).columns["g1"].factor("g1"))
    beyond = [10**12, -1][1 - side] if name == "bits" else bound * [0.01, 100][side]
    with pytest.raises(FileFormatError, match=f"columns.g1: {name} must lie between"):
        LogMap.load(written(beyond))


@pytest.mark.parametrize(
    "content, log_map, message",
    [
        ("t_s;g1\n0,1;1,5\n0,2;1.234,5\n", None, r"line 3, column g1: expected a number, got '1.234,5'"),
        ("t_s,g1\n0,1\n1,2\n", LogMap(header_line=900), "ends above line 900, where its header should be"),
        ("t_s,strain1\n0,1\n1,2\n", LogMap({"g1": Column("strain_1", "strain")}),
         r"has no column 'strain_1'; did you mean strain1\?"),
        ("t_s,g1,Fz [N],load_gf\n0,1,0,0\n1,2,0,0\n", None,
         r"Fz \[N\] and load_gf are both force_N: say which one is in a map"),
        # A wrong number of cells, no known unit, and numbers next to units
        ("t_s,force_N,g1\ns,N\n0,1,2\n1,1,2\n", None, "line 2"),
        ("t_s,force_N,g1\nsecond,newton,gram\n0,1,2\n1,1,2\n", None, "line 2"),
        ("t_s,force_N,g1\ns,1,N\n0,1,2\n1,1,2\n", None, "line 2"),
        ("t_s,force_N,g1\nnan,N,nan\n0,1,2\n1,1,2\n", None, "line 2"),
    ],
)  # fmt: skip
def test_a_log_that_does_not_fit_is_refused(file, content, log_map, message):
    with pytest.raises(FileFormatError, match=message):
        read_time_log(file(content), log_map=log_map)


@pytest.mark.parametrize(
    "content, expected",
    [
        ("time (us)\tSG 1\tSG 2\n0\t1e-5\t2e-5\n1000\t2e-5\t3e-5\n", {"t_s": "us", "g1": "strain", "g2": "strain"}),
        ("Zeit;DMS1 (mV/V);Kraft [N]\n0,00;0,12;0,3\n0,01;0,13;0,4\n", {"t_s": "s", "g1": "mV/V", "force_N": "N"}),
        ("stamp,ai0,ai1,load\n2026-01-02 03:04:05.1,2000,2010,0.1\n2026-01-02 03:04:05.2,2001,2002,0.1\n",
         {"t_s": "iso", "g1": "counts", "g2": "counts", "force_N": "N"}),
        ("# rig 3\n# 1 kHz\n\ntime,strain,vel\n0.000,5,10\n0.001,6,10\n", {"t_s": "s", "g1": "microstrain"}),
        ("force_gf,E_kPa,g1\n10,50,1\n20,60,2\n", {"force_N": "gf", "modulus_MPa": "kPa", "g1": "microstrain"}),
    ],
)  # fmt: skip
def test_a_proposed_map_reads_its_own_log(file, content, expected):
    path = file(content)
    found = propose(path)
    guessed = {guess.meant: guess.unit for guess in found.guesses if guess.meant}
    assert guessed.items() >= expected.items()
    bridge = any(guess.unit in ("mV/V", "V", "counts") for guess in found.guesses if guess.meant)
    assert any("the numbers of the gauges' amplifier" in question for question in found.open_questions) == bridge
    log_map = LogMap.load(file(found.to_toml(), "proposed.toml"))
    read = read_presses if "modulus_MPa" in guessed else read_time_log
    assert read(path, log_map=log_map).readings.shape[1] == sum(name.startswith("g") for name in guessed)


@pytest.mark.parametrize("row", [0, 1])
def test_what_is_no_date_is_named_with_its_place(file, row):
    stamps = ["2026-01-02 03:04:05.1", "2026-01-02 03:04:05.2"]
    stamps[row] = "2026-13-02 03:04:05"
    path = file("stamp,g1\n" + "".join(f"{stamp},1\n" for stamp in stamps))
    with pytest.raises(FileFormatError, match=rf"line {row + 2}.*stamp.*expected a date and time, got '2026-13"):
        read_time_log(path, log_map=LogMap({"t_s": Column("stamp", "iso"), "g1": Column("g1", "microstrain")}))


def test_commands_read_by_a_map_and_propose_one(file, tmp_path, monkeypatch, capsys):
    from papilla.cli.main import run

    rows = "".join(f"{k};{10 * (k % 5)};{k % 3}\n" for k in range(200))
    file("ms;gf;ch1\n" + rows, "lab.csv")
    monkeypatch.chdir(tmp_path)

    def called(*arguments: str) -> int:
        with pytest.raises(SystemExit) as end:
            run([*arguments])
        return int(end.value.code or 0)

    assert called("log", "map", "lab.csv", "--out", "proposed.toml") == 0
    said = capsys.readouterr()
    assert "ch1" in said.out and "no column seems to be a time" in said.err
    columns = 't_s = { column = "ms", unit = "ms" }\nforce_N = { column = "gf", unit = "gf" }\n'
    file(f'[columns]\n{columns}g1 = {{ column = "ch1", unit = "microstrain" }}\n', "by.toml")
    assert called("estimate", "lab.csv", "--out", "e.csv") == 2
    assert "column t_s is missing" in capsys.readouterr().err
    assert called("estimate", "lab.csv", "--map", "by.toml", "--out", "e.csv") == 0
    assert "columns by by.toml: ms is t_s in ms, gf is force_N in gf, ch1 is g1" in capsys.readouterr().err
    assert called("estimate", "lab.csv", "--map", "by.toml", "--out", "by.toml") == 2
    assert (tmp_path / "by.toml").read_text().startswith("[columns]")


def frames():
    columns = {"t_s": np.arange(5) / 1e3, "g1": np.arange(5.0), "force_gf": np.arange(5), "room": np.array(["a"] * 5)}
    yield columns
    yield np.rec.fromarrays([columns[name] for name in ("t_s", "g1", "force_gf")], names="t_s,g1,force_gf")

    class Frame:
        """As pandas and polars have it."""

        columns = ("t_s", "g1", "force_gf")

        def __getitem__(self, name):
            return columns[name]

    yield Frame()


@pytest.mark.parametrize("frame", [*frames()], ids=lambda frame: type(frame).__name__)
def test_a_frame_goes_where_a_file_goes(frame):
    found = read_time_log(frame)
    assert found.readings[:, 0].tolist() == [0, 1, 2, 3, 4] and found.sample_rate_Hz == pytest.approx(1000)
    np.testing.assert_allclose(found.force_N, np.arange(5) * GF)
    presses = read_presses({"force_N": [0.1, 0.2], "modulus_MPa": [0.1, 0.2], "g1": [1, 2]})
    assert presses.readings.tolist() == [[1], [2]]


@pytest.mark.parametrize(
    "frame, message",
    [
        ({"t_s": [0, 1], "g1": ["a", "b"]}, "the frame, column g1: expected one number per row"),
        ({"t_s": [0, 1], "g1": [1]}, "columns must be equally long"),
        ({"t_s": [], "g1": []}, "the frame holds columns but no rows"),
        ({"time": [0, 1], "g1": [1, 2]}, "column t_s is missing"),
        (3, "a log is a file, a frame, a dict of columns or a structured array, got int"),
    ],
)
def test_a_bad_frame_is_one_line(frame, message):
    with pytest.raises(InputError, match=message):
        read_time_log(frame)


@pytest.mark.parametrize("zone", ["", "Z", "+02:00", " +02:00"])
def test_dates_and_times_may_state_a_zone(tmp_path, zone):
    """Also one that changes in the log, when the clocks do."""
    stamps = [f"2026-10-25 02:59:59.{k}{zone}" for k in (0, 25, 5)]
    after = {"": "2026-10-25 03:00:00", "Z": "2026-10-25T03:00:00Z"}.get(zone, f"2026-10-25 02:00:00{zone[:-5]}01:00")
    (tmp_path / "log.csv").write_text("\n".join(["when,ch1,ch2", *(f"{one},7,8" for one in [*stamps, after])]))
    proposed = propose(tmp_path / "log.csv")
    assert [one.meant for one in proposed.guesses] == ["t_s", "g1", "g2"]
    (tmp_path / "log_map.toml").write_text(proposed.to_toml())
    assert read_time_log(tmp_path / "log.csv").t_s.tolist() == [0, 0.25, 0.5, 1]


def test_dates_and_spans_in_a_frame_are_not_taken_for_seconds():
    dates, spans = np.array([0, 10, 20], "datetime64[ms]"), np.array([0, 10, 20], "timedelta64[ms]")
    with pytest.raises(FileFormatError, match="column t_s: expected numbers: give it the unit iso in a map, got datet"):
        read_time_log({"t_s": dates, "g1": [1, 2, 3]})
    with pytest.raises(FileFormatError, match="column t_s: expected numbers, such as seconds, got timedelta64"):
        read_time_log({"t_s": spans, "g1": [1, 2, 3]})
    with_map = LogMap({"t_s": Column("t_s", "iso"), "g1": Column("g1", "microstrain")})
    assert read_time_log({"t_s": dates, "g1": [1, 2, 3]}, log_map=with_map).t_s.tolist() == [0, 0.01, 0.02]


def test_parquet(tmp_path):
    pyarrow = pytest.importorskip("pyarrow", reason="needs the extra tables")
    parquet = pytest.importorskip("pyarrow.parquet")
    stamps = np.datetime64("2026-01-02T03:04:05") + np.arange(4) * np.timedelta64(10, "ms")
    table = pyarrow.table({"stamp": stamps, "ch1": [1e-6, 2e-6, None, 4e-6], "load": [10, 20, 30, 40]})
    path = tmp_path / "log.parquet"
    parquet.write_table(table, path)
    proposed = propose(path)
    assert {one.meant: one.unit for one in proposed.guesses} == {"t_s": "iso", "g1": "strain", "force_N": "gf"}
    (tmp_path / "log_map.toml").write_text(proposed.to_toml())
    found = read_time_log(path)
    np.testing.assert_allclose(found.t_s, [0, 0.01, 0.02, 0.03])
    np.testing.assert_allclose(found.readings[:, 0], [1, 2, np.nan, 4])
    path.write_bytes(b"PAR1 no")
    with pytest.raises((FileFormatError, FileAccessError), match="log.parquet"):
        read_time_log(path)


def test_a_number_that_is_missing_is_null_in_parquet(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet", reason="needs the extra tables")
    with estimates_writer(tmp_path / "e.parquet", ("t_s", "modulus_MPa", "modulus_status")) as write:
        for t_s in ([0.0, 1.0], [2.0]):
            write([np.array(t_s), np.array([0.5, np.nan][: len(t_s)]), ["ok"] * len(t_s)])
    found = parquet.read_table(tmp_path / "e.parquet").to_pydict()
    assert found == {"t_s": [0, 1, 2], "modulus_MPa": [0.5, None, 0.5], "modulus_status": ["ok"] * 3}


@pytest.fixture
def parquet_file(tmp_path):
    pyarrow = pytest.importorskip("pyarrow", reason="needs the extra tables")
    from pyarrow.parquet import write_table

    def write(**columns):
        table = pyarrow.table(columns)
        write_table(table, tmp_path / "log.parquet", row_group_size=3 if len(table) < 100 else None)
        return tmp_path / "log.parquet"

    return write


def gauges(**columns):
    return LogMap({name: Column(column, "microstrain") for name, column in columns.items()}, path=Path("m.toml"))


def test_elements_of_lists_are_columns(parquet_file):
    lists = [[k, k / 2, -k] for k in range(8)]
    path = parquet_file(t_s=np.arange(8, dtype=np.float32), **{"observation.state": [*lists[:5], None, *lists[6:]]})
    found = read_time_log(path, log_map=gauges(g1="observation.state[2]", g2="observation.state[0]"))
    np.testing.assert_array_equal(found.readings[:, 0], [0, -1, -2, -3, -4, np.nan, -6, -7])
    np.testing.assert_array_equal(found.readings[:, 1], [0, 1, 2, 3, 4, np.nan, 6, 7])
    assert [guess.name for guess in propose(path).guesses][1:] == [f"observation.state[{k}]" for k in range(3)]
    shorter = parquet_file(t_s=np.arange(8.0), a=[*lists[:5], [1.0, 2.0], *lists[6:]])
    with pytest.raises(FileFormatError, match=r"log.parquet, column a: 2 numbers in row 5, 3 in the first"):
        read_time_log(shorter, log_map=gauges(g1="a[2]"))
    path = parquet_file(t_s=np.arange(8.0), **{"observation.state": lists})
    for column in ("observation.state", "observation.state[3]"):
        with pytest.raises(
            FileFormatError, match=r"it holds lists of 3 numbers: name one of them, observation.state\[0"
        ):
            read_time_log(path, log_map=gauges(g1=column))


@pytest.mark.parametrize(
    "cells, why",
    [
        ([{"a": 1}], "it holds struct<a: int64>, not numbers"),
        ([[[1.0]]], "it holds lists of list<element: double>, not of numbers"),
        ([["a"]], "it holds lists of string, not of numbers"),
        ([[]], "it holds lists of null, not of numbers"),
        ([[0.0] * 65], "its first list has 65 numbers; 1 to 64 become columns"),
        ([b"a"], "it holds binary, not numbers"),
        ([datetime.time(1)], "expected one number per row"),
        ([datetime.datetime(2026, 1, 1)], "expected numbers: give it the unit iso in a map"),
        (["a"], "expected one number per row"),
        (["1" * 2000], "a text of 2000 characters; at most 1000 are one"),
    ],
)
def test_columns_of_other_types_are_named(parquet_file, cells, why):
    path = parquet_file(t_s=np.arange(4.0), odd=cells * 4, ch=np.arange(4.0))
    with pytest.raises(FileFormatError) as caught:
        read_time_log(path, log_map=gauges(g1="odd"))
    assert str(path) in str(caught.value) and "odd" in str(caught.value) and why in str(caught.value)
    assert read_time_log(path, log_map=gauges(g1="ch")).readings[:, 0].tolist() == [0, 1, 2, 3]


def test_decimals_dictionaries_and_half_floats_are_numbers(parquet_file):
    pyarrow = pytest.importorskip("pyarrow")
    columns = {"dec": [decimal.Decimal("1.5"), None, decimal.Decimal(2)], "half": np.array([1.5, 0, 2], np.float16)}
    columns |= {"cat": pyarrow.array([7, 8, 7]).dictionary_encode(), "yes": [True, None, False]}
    path = parquet_file(t_s=np.arange(3.0), **columns)
    found = read_time_log(path, log_map=gauges(g1="dec", g2="half", g3="cat", g4="yes"))
    np.testing.assert_array_equal(found.readings.T, [[1.5, np.nan, 2], [1.5, 0, 2], [7, 8, 7], [1, np.nan, 0]])


def test_more_than_memory_holds_is_refused_before_it_is_read(parquet_file):
    """20 million equal rows in some kB, of which 999 columns are wanted: 8e11 bytes."""
    rows = 20_000_000
    path = parquet_file(t_s=np.zeros(rows, np.int8), ch=np.zeros(rows, np.int8))
    with pytest.raises(MemoryEstimateError, match=rf"reading {path} \(20000000 rows, 1000 columns\) needs about"):
        read_time_log(path, log_map=gauges(**{f"g{k}": "ch" for k in range(1, 1000)}))


@pytest.mark.parametrize("covered_N, remarks", [(None, 0), (1.22, 1), (1.23, 0)])
def test_a_force_is_compared_with_what_the_calibration_covers(file, covered_N, remarks):
    with TimeLogFile(file("t_s,g1,force_N\n0,1,3\n1e-3,2,12\n"), covered_N=covered_N) as log:
        assert len(log.report.sizes) == remarks
        assert all(note.startswith("force_N comes to 12: this looks like gf") for note in log.report.sizes)
