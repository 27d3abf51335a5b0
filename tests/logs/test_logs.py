"""Reading time logs and bench logs: what comes out, and one clear line for each bad file."""

import contextlib
import os
import re
import threading

import numpy as np
import pytest

from papilla.core import tables
from papilla.core.errors import FileAccessError, FileFormatError, InputError
from papilla.core.rows import BLOCK_ROWS as ROWS_OF_A_BLOCK
from papilla.core.tables import TableReader, write_table
from papilla.logs import TimeLogFile, read_presses, read_time_log, statistics, white_noise
from papilla.model.specimen import Block, HalfSpace, Sphere

TIME = "t_s,g1,g2,force_N\n0.000,1,2,0.1\n0.001,3,4,0.2\n0.002,5,6,0.3\n"
BENCH = "force_N,modulus_MPa,g1,g2\n0.1,0.5,10,20\n0.2,0.5,30,50\n"


@pytest.fixture
def log(tmp_path):
    def write(content: str | bytes):
        write.path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return write.path

    write.path = tmp_path / "log.csv"
    return write


def test_time_log_columns(log):
    found = read_time_log(log(TIME))
    assert found.t_s.tolist() == [0.0, 0.001, 0.002]
    assert found.readings.tolist() == [[1, 2], [3, 4], [5, 6]]
    assert found.gauge_names == ("g1", "g2")
    assert found.force_N.tolist() == [0.1, 0.2, 0.3]
    assert found.velocity_mm_s is None and found.position_mm is None and found.tangential_N is None
    assert found.sample_rate_Hz == pytest.approx(1000)
    assert (found.report.rows, found.report.gaps, found.report.duplicates, found.report.nan_rows) == (3, 0, 0, 0)


def test_time_log_counts_gaps_duplicates_and_missing_cells(log):
    rows = ["0.000,1,2,0.1", "0.001,nan,2,0.1", "0.001,1,2,0.1", "0.002,,2,", "0.003,inf,2,0.1", "0.013,1,2,0.1"]
    found = read_time_log(log("t_s,g1,g2,force_N\n" + "\n".join(rows)))
    assert len(found) == 6
    report = found.report
    assert (report.gaps, report.duplicates, report.nan_cells, report.nan_rows) == (1, 1, 4, 3)
    assert np.isnan(found.readings[1, 0]) and np.isnan(found.force_N[3])
    assert found.sample_rate_Hz == pytest.approx(1000), "gaps and duplicates do not bend the sampling rate"


def test_numbers_that_no_sensor_gives_are_counted_and_remarked_on(log):
    report = read_time_log(log("t_s,g1,force_N\n0,1,1e155\n1,-1e200,1\n2,1,inf\n")).report
    assert (report.unbelievable, report.nan_cells) == (2, 1)
    assert report.notes == ("2 cells hold numbers beyond 1e+12: they count as missing",) + report.notes[1:]


def test_byte_order_mark_spaces_and_trailing_lines_are_tolerated(log):
    found = read_time_log(log(b"\xef\xbb\xbf" + TIME.replace(",", ", ").encode() + b"\n\n"))
    assert found.readings.shape == (3, 2)


def test_unknown_columns_are_named_and_not_parsed(log):
    found = read_time_log(log("t_s,note,g1\n0,soft sponge,1\n1,,2\n"))
    assert found.report.notes == ("ignored columns: note",)
    assert read_presses(log("material,force_N,modulus_MPa,g1\nA,1,1,1\nB,1,2,3\n")).notes == (
        "ignored columns: material",
    )


def test_a_file_without_its_last_line_end_is_remarked_on(log):
    """Cut off in its last number it is still a table: nothing else tells."""
    assert read_time_log(log("t_s,g1\n0,100\n1,200\n")).report.notes == ()
    for cut in ("t_s,g1\n0,100\n1,2", "t_s,note,g1\n0,a,100\n1,b,2"):
        *_, last = read_time_log(log(cut)).report.notes
        assert last.startswith("the last line has no line end")
    assert len(read_presses(log("force_N,modulus_MPa,g1\n1,1,1\n2,1,2")).notes) == 1


def test_written_table_reads_back_bit_for_bit(tmp_path):
    values = np.random.default_rng(1).normal(size=(50, 3)) * 10.0 ** np.arange(-8, 10, 6)
    values[7, 1] = np.nan
    columns = {"t_s": np.arange(50) / 1000, **{f"g{i + 1}": values[:, i] for i in range(3)}}
    write_table(tmp_path / "log.csv", columns)
    assert ",," in (tmp_path / "log.csv").read_text()
    found = read_time_log(tmp_path / "log.csv")
    assert np.array_equal(found.readings, values, equal_nan=True)
    assert np.array_equal(found.t_s, columns["t_s"])


def test_bench_log_columns(log):
    found = read_presses(
        log("force_N,modulus_MPa,g1,g2,indentation_mm,x_mm,y_mm\n.1,.5,10,20,1,2,3\n.2,.5,30,50,4,5,6\n")
    )
    assert found.force_N.tolist() == [0.1, 0.2]
    assert found.modulus_MPa.tolist() == [0.5, 0.5]
    assert found.readings.tolist() == [[10, 20], [30, 50]]
    assert found.sd_microstrain.tolist() == [5, 10], "population standard deviation"
    assert found.indentation_mm.tolist() == [1, 4]
    assert (found.x_mm.tolist(), found.y_mm.tolist()) == ([2, 5], [3, 6])
    plain = read_presses(log(BENCH))
    assert plain.indentation_mm is None and plain.x_mm is None and plain.y_mm is None


@pytest.mark.parametrize(
    "content, message",
    [
        ("", "is empty"),
        ("\n0,1\n", "is empty or starts with an empty line"),
        ("t_s,g1\n", "holds a header but no rows"),
        ("t_s,g1\n0,1\n", "has one row"),
        ("t_s,force_N\n0,1\n1,1\n", "no gauge column g1, g2, ... (found t_s, force_N)"),
        ("time,g1\n0,1\n1,1\n", "column t_s is missing (found g1, time)"),
        ("t_s,G1\n0,1\n1,1\n", "unknown column G1; did you mean g1?"),
        ("t_s,g1,force_n\n0,1,1\n1,1,1\n", "unknown column force_n; did you mean force_N?"),
        ("t_s,g1,g1\n0,1,1\n1,1,1\n", "column g1 occurs twice"),
        ("t_s,g1,\n0,1,1\n1,1,1\n", "column 3 has no name"),
        ("t_s|g1\n0|1\n1|1\n", "column t_s is missing (found t_s|g1)"),
        ("t_s,g1\n0,1\n1,1_000\n", "line 3, column g1: expected a number, got '1_000'"),
        ("t_s,g1\n0,1\n1,\uff11\uff12\n", "line 3, column g1: expected a number, got '\uff11\uff12'"),
        ("t_s," + ",".join(f"g{k}" for k in range(1, 1001)) + "\n0\n", "1001 columns; no table of papilla has more"),
        ("t_s" * 2**19, "line 1: longer than 262144 bytes"),
        ("t_s,g1\n0,1\n1," + "1" * 2**19 + "\n", "line 3: longer than 262144 bytes"),
        ("t_s,g1\n0,1\n" + "," * 2**17 + "\n1,2\n", "line 3: 131073 cells where the header has 2 columns"),
        ("t_s,g1\r0,1\r" + "1" * 2**19, "longer than 262144 bytes"),
        (f"t_s,{'g' * 1001}\n0,1\n1,2\n", "line 1: a column's name has 1001 characters"),
        ("t_s,g1\n0,1\n1e155,1\n", "line 3, column t_s: expected a time in s, got 1e+155"),
        ("t_s,g1\n0,1\n1,abc\n", "line 3, column g1: expected a number, got 'abc'"),
        ("t_s,g1\n0,1\n1,1,1\n", "line 3: 3 cells where the header has 2 columns"),
        ("t_s,g1\n0,1\n\n1\n", "line 4: 1 cells where the header has 2 columns"),
        ("t_s,g1\n0,1\n,1\n", "line 3, column t_s: expected a finite number, got nan"),
        ("t_s,g1\n0,1\n2,1\n1,1\n", "line 4, column t_s: time goes back from 2 to 1 s"),
        ("t_s,g1\n1,1\n1,1\n", "all rows have the time 1 s"),
        ('t_s,g1\n0,1\n1,"1\n', "not readable as CSV"),
        (b"t_s,g1\n0,1\n1,\xff\n", "line 3: not a text file in UTF-8"),
        ("t_s,g1\n0,1\n".encode("utf-16"), "line 1: not a text file in UTF-8"),
    ],
)
def test_bad_time_log(log, content, message):
    with pytest.raises(FileFormatError) as caught:
        read_time_log(log(content))
    assert message in str(caught.value)
    assert "log.csv" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "content, message",
    [
        ("force_N,g1\n1,1\n1,1\n", "column modulus_MPa is missing"),
        ("force_N,modulus_mpa,g1\n1,1,1\n1,1,1\n", "unknown column modulus_mpa; did you mean modulus_MPa?"),
        ("force_N,modulus_MPa,g1\n1,1,1\n", "has one row"),
        ("force_N,modulus_MPa,g1\n1,1,1\n1,1,nan\n", "line 3, column g1: expected a finite number, got nan"),
        ("force_N,modulus_MPa,g1\n1,1,1\n1,1,-1e200\n", "line 3, column g1: expected a finite number of at most 1e+12"),
        ("force_N,modulus_MPa,g1\n1,1,1\n1,,1\n", "line 3, column modulus_MPa: expected a finite number, got nan"),
        ("force_N,modulus_MPa,g1\n0,1,1\n1,1,1\n", "line 2, column force_N: must be greater than 0, got 0"),
        ("force_N,modulus_MPa,g1\n1,1,1\n1,-2,1\n", "line 3, column modulus_MPa: must be greater than 0, got -2"),
        ("force_N,modulus_MPa,g1,specimen\n1,1,1,block\n1,1,1,block\n", "column specimen: presses on specimens of"),
        ("t_s,force_N,modulus_MPa,g1\n0,1,5,1\n0,2,5,2\n", "line 3, column t_s: must rise, got 0 after 0"),
        ("t_s,force_N,modulus_MPa,g1\n0,5,5,1\n1,2,5,2\n2,1,5,2\n", "only 1 of 3 rows load the finger"),
        ("t_s,force_N,modulus_MPa,g1\n0,1,5,1\nnan,2,5,2\n", "column t_s: expected a finite number"),
    ],
)
def test_bad_bench_log(log, content, message):
    with pytest.raises(FileFormatError) as caught:
        read_presses(log(content))
    assert message in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("read", [read_time_log, read_presses])
def test_missing_file_and_folder(read, tmp_path):
    with pytest.raises(FileAccessError, match=r"cannot read .*nowhere.csv: No such file"):
        read(tmp_path / "nowhere.csv")
    with pytest.raises(FileAccessError, match="cannot read"):
        read(tmp_path)


@pytest.mark.parametrize("blocks", [1, 7, 40])
def test_extremes_survive_thinning_and_bins_stay_few(blocks):
    rng = np.random.default_rng(2)
    rows = np.column_stack([np.arange(3001.0), rng.normal(size=3001), np.full(3001, np.nan)])
    rows[1234, 1], rows[2345, 1], rows[:40, 1] = 9.0, -9.0, np.nan
    found = statistics.Thinned(bins=50)
    for part in np.array_split(rows, blocks):
        found.add(part)
    found.add(rows[:0])
    low, high = found.low, found.high
    assert 30 < len(low) < 100 and low.shape == high.shape == (len(low), 3)
    assert (np.diff(low[:, 0]) > 0).all() and (low[1:, 0] == high[:-1, 0] + 1).all() and low[0, 0] == 0
    assert np.nanargmax(high[:, 1]) == np.searchsorted(high[:, 0], 1234) and np.nanmax(high[:, 1]) == 9.0
    assert np.nanargmin(low[:, 1]) == np.searchsorted(high[:, 0], 2345) and np.isnan(high[:, 2]).all()


LONG = "t_s,force_N,g2,g1\n" + "".join(f"{k / 100},{k % 7},{k * k % 11},{k}\n\n" for k in range(100))


def test_blocks_change_nothing(log):
    with TableReader(log(LONG), lambda name: True) as reader:
        (whole,) = reader.blocks(1000)
        for size in (1, 3, 7, 99):
            pieces = list(reader.blocks(size))
            assert max(len(piece.lines) for piece in pieces) <= size
            for name, column in whole.columns.items():
                np.testing.assert_array_equal(np.concatenate([piece.columns[name] for piece in pieces]), column)
            assert np.concatenate([piece.lines for piece in pieces]).tolist() == whole.lines.tolist()


def test_gaps_repeats_and_noise_of_a_log_of_many_blocks_are_those_of_its_rows(log):
    """Rows thrice as many as a block: gaps and a repeated time stand at their seams, too."""
    rng, count = np.random.default_rng(5), 3 * ROWS_OF_A_BLOCK
    t = np.arange(count) / 1000
    t[ROWS_OF_A_BLOCK:] += 0.05
    t[2 * ROWS_OF_A_BLOCK] = t[2 * ROWS_OF_A_BLOCK - 1]
    noise = rng.normal(0, 3, count)
    found = read_time_log(log("t_s,g1\n" + "".join(f"{a:.3f},{b:.4f}\n" for a, b in zip(t, noise, strict=True))))
    assert (found.report.gaps, found.report.duplicates) == (2, 1)
    assert found.sample_rate_Hz == pytest.approx(1000, rel=1e-3)
    assert white_noise(found.readings[:, 0]) == pytest.approx(3, rel=0.02)
    with TimeLogFile(log.path) as file:
        assert file.noise["g1"] == pytest.approx(white_noise(found.readings[:, 0]), rel=1e-9)


@pytest.mark.parametrize("row", range(6, 13))
def test_faults_are_found_in_every_place_of_a_block(log, row):
    lines = LONG.splitlines()
    for cell, message in {f"{row / 100 - 0.05}": "time goes back", "nan": "finite number", "x": "a number"}.items():
        rows = [*lines[: 2 * row + 1], f"{cell},1,1,1", *lines[2 * row + 2 :]]
        with pytest.raises(FileFormatError, match=f"line {2 * row + 2}, column t_s: .*{message}"):
            read_time_log(log("\n".join(rows)))
        with TableReader(log.path, lambda name: True) as reader, contextlib.suppress(FileFormatError):
            list(reader.blocks(3))
            assert cell != "x"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_stream_that_can_be_read_once_is_read_like_a_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    writer = threading.Thread(target=(tmp_path / "pipe").write_text, args=[TIME])
    writer.start()
    assert read_time_log(tmp_path / "pipe").readings.tolist() == [[1, 2], [3, 4], [5, 6]]
    writer.join()


def test_rows_that_come_while_a_log_is_read_are_left_for_the_next_time(log):
    with TimeLogFile(log(TIME)) as file:
        with open(log.path, "a") as stream:
            stream.write("0.003,7,8,0.4\n")
        assert sum(len(block) for block in file.blocks()) == file.report.rows == 3


def test_a_table_that_fails_half_way_leaves_no_file(tmp_path):
    def write():
        with tables.table_writer(tmp_path / "out.csv", ["a"]) as rows:
            rows([[1.0, float("nan")]])
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write()
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(FileAccessError, match="null byte"):
        write_table("a\0b", {"a": [1.0]})
    with pytest.raises(FileAccessError, match="cannot read"):
        read_time_log("a\0b")


def test_bench_log_written_and_read_again(log, tmp_path):
    text = "force_N,modulus_MPa,g2,g1,x_mm,y_mm\n.1,.5,10,20,0,0\n.2,.5,30,50,0,0\n"
    first = read_presses(log(text))
    assert first.gauge_names == ("g1", "g2") and first.readings.tolist() == [[20, 10], [50, 30]], (
        "gauges by their number"
    )
    first.to_csv(tmp_path / "again.csv")
    second = read_presses(tmp_path / "again.csv")
    assert np.array_equal(second.readings, first.readings)
    assert second.x_mm.tolist() == [0, 0] and second.indentation_mm is None


# ---- Presses on specimens of their own, and S_d alone

BLOCK = Block(1.0, 8.0)
MIXED = (
    "force_N,modulus_MPa,g1,specimen,thickness_mm,radius_mm,modulus_sigma_MPa\n"
    "1,0.5,1,block,12,,0.01\n1,0.5,2,half-space,,,0.01\n1,0.5,3,sphere,,20,0.01\n1,0.5,4,,,,0.01\n1,0.5,5,block,,,0\n"
)


def test_each_press_may_say_what_it_was_on(log, tmp_path):
    found = read_presses(log(MIXED), mixed=BLOCK)
    assert found.specimens == (Block(1.0, 12.0), HalfSpace(1.0), Sphere(1.0, 20.0), BLOCK)
    assert found.on.tolist() == [0, 1, 2, 3, 3] and found.modulus_sigma_MPa.tolist() == [0.01] * 4 + [0.0]
    found.to_csv(tmp_path / "again.csv")
    again = read_presses(tmp_path / "again.csv", mixed=Block(1.0, 3.0))
    assert again.specimens == found.specimens and (again.on == found.on).all()
    measures = read_presses(log("force_N,modulus_MPa,g1,radius_mm\n1,1,1,5\n1,1,2,\n"), mixed=HalfSpace(1.0))
    assert measures.specimens == (Sphere(1.0, 5.0), HalfSpace(1.0))
    plain = read_presses(log("force_N,modulus_MPa,g1,modulus_sigma_MPa\n1,1,1,0\n1,1,2,0.1\n"), mixed=BLOCK)
    assert plain.on is None and plain.specimens == ()


def test_s_d_alone_is_read_where_it_is_enough(log):
    found = read_presses(log("force_N,modulus_MPa,sd_microstrain\n1,0.5,80\n2,0.5,90\n"), mixed=BLOCK)
    assert found.gauge_names == () and found.sd_microstrain.tolist() == [80, 90]
    with pytest.raises(FileFormatError, match="column sd_microstrain: must be greater than 0, got 0"):
        read_presses(log("force_N,modulus_MPa,sd_microstrain\n1,0.5,80\n2,0.5,0\n"), mixed=BLOCK)


@pytest.mark.parametrize(
    "row, said",
    [
        ("foam,,,0", "column specimen: expected block, half-space, sphere, got 'foam'"),
        ("sphere,,,0", "column specimen: a sphere needs its radius_mm"),
        ("half-space,3,,0", "column thickness_mm: a half-space has none, got 3: leave the cell empty"),
        (",3,4,0", "column thickness_mm: a sphere has none, got 3"),
        ("block,-3,,0", "column thickness_mm: must be greater than 0, got -3"),
        ("block,3,,-1", "column modulus_sigma_MPa: expected a number of at least 0, got -1"),
        ("block,3,,", "column modulus_sigma_MPa: expected a number of at least 0, got nan"),
    ],
)
def test_a_specimen_that_cannot_be_is_refused_with_its_line(log, row, said):
    text = MIXED.splitlines()[0] + f"\n1,1,1,block,5,,0.1\n1,1,1,{row}\n"
    with pytest.raises(FileFormatError, match=f"line 3, {re.escape(said)}"):
        read_presses(log(text), mixed=BLOCK)


@pytest.mark.parametrize(
    "cells",
    [
        ["1", "-2.5e-3", "nan", "inf", "+.5", "1e400", "5."], ["1", " 2", "3"], ["1", "", "3"], ["1", '"2"', "3"],
        ["NaN", "Infinity", "0.30000000000000004"],
    ],
)  # fmt: skip
@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_cells_are_the_numbers_that_python_reads(tmp_path, cells, line_end):
    """To the bit, whether all lines of a block are plain numbers or not."""
    rows = [",".join([str(number), cell]) for number, cell in enumerate(cells * 3)]
    (tmp_path / "a.csv").write_text(line_end.join(["a,b", *rows, ""]), newline="")
    with TableReader(tmp_path / "a.csv", lambda name: True) as reader:
        tables = list(reader.blocks(4))
    found = np.concatenate([table.columns["b"] for table in tables])
    expected = [float(cell.strip('"') or "nan") for cell in cells * 3]
    np.testing.assert_array_equal(found, expected)
    assert np.concatenate([table.columns["a"] for table in tables]).tolist() == list(range(len(rows)))
    assert np.concatenate([table.lines for table in tables]).tolist() == list(range(2, 2 + len(rows)))


def test_spaces_after_empty_lines_are_a_line_of_one_cell(tmp_path):
    (tmp_path / "a.csv").write_text("a,b\n\n1,2\n\n3,4\n5,6\n \t\n")
    with TableReader(tmp_path / "a.csv", lambda name: True) as reader:
        for size in (1, 2, 100):
            with pytest.raises(FileFormatError, match="line 7: 1 cells where the header has 2 columns"):
                list(reader.blocks(size))


def test_a_quoted_cell_goes_on_in_the_next_chunk_and_lines_stay_right(tmp_path):
    (tmp_path / "a.csv").write_text('a,b\n1,2\n3,"4\n"\n5,6\n7,x\n')
    with TableReader(tmp_path / "a.csv", lambda name: True) as reader:
        found = []
        with pytest.raises(FileFormatError, match="line 6, column b: expected a number, got 'x'"):
            found += reader.blocks(2)
        with pytest.raises(FileFormatError, match="line 6"):
            list(reader.blocks(1))


# ---- A torque, which over its lever arm is a tangential force

TORQUE = "t_s,g1,force_N,velocity_mm_s,torque_Nmm\n0,1,0.5,10,8\n0.001,2,0.5,10,-8\n0.002,3,0.5,10,nan\n"


def test_a_torque_over_its_lever_is_the_tangential_force(log):
    found = read_time_log(log(TORQUE), lever_mm=40.0)
    assert found.tangential_N == pytest.approx([0.2, -0.2, np.nan], nan_ok=True) and found.report.nan_cells == 1
    with TimeLogFile(log.path, lever_mm=40.0) as file:
        assert file.optional == ("force_N", "velocity_mm_s", "tangential_N")
        assert np.concatenate(list(file.blocks()))[0, -1] == pytest.approx(0.2)
    alone = read_time_log(log("t_s,force_N,torque_Nmm\n0,1,2\n0.001,1,2\n"), lever_mm=10.0)
    assert alone.tangential_N == pytest.approx([0.2, 0.2]), "a torque alone needs no gauges"


@pytest.mark.parametrize(
    "content, lever_mm, message",
    [
        (TORQUE, None, "torque_Nmm needs its lever arm"),
        (TORQUE, -1.0, "lever_mm must be greater than 0"),
        ("t_s,g1\n0,1\n0.001,2\n", 40.0, "there is no column torque_Nmm"),
        ("t_s,g1,tangential_N,torque_Nmm\n0,1,1,1\n0.001,2,1,1\n", 40.0, "not both"),
    ],
)
def test_a_torque_and_a_lever_that_do_not_fit_are_refused(log, content, lever_mm, message):
    with pytest.raises(InputError, match=message):
        read_time_log(log(content), lever_mm=lever_mm)
