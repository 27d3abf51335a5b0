"""Standard input row by row: the same answers as from a file, at once, in constant memory; signals end with a line."""

import io
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from papilla.core.errors import FileFormatError
from papilla.core.pipes import LONGEST_TABLE_LINE, PIPE_CHUNK_BYTES, LiveText, ShortLines
from papilla.core.rows import Table
from papilla.logs import TimeLogFile, time_log


def rows(count: int) -> list[str]:
    rng = np.random.default_rng(1)
    noise = rng.normal(0, 1, (count, 2))
    return [f"{k / 1e3:.3f},{10 + a:.4f},{20 + b:.4f},0.1,40\n" for k, (a, b) in enumerate(noise)]


HEADER = "t_s,g1,g2,force_N,velocity_mm_s\n"


@pytest.fixture
def pipe(monkeypatch):
    """Standard input in the place of the real one: writes text to it; `None` ends it."""
    reading, writing = os.pipe()
    stdin = os.fdopen(reading)
    monkeypatch.setattr(sys, "stdin", stdin)
    ends = {writing}

    def write(text: str | None) -> None:
        if text is None:
            os.close(writing)
            ends.clear()
        else:
            os.write(writing, text.encode())

    yield write
    for end in ends:
        os.close(end)
    stdin.close()


def test_the_first_lines_can_be_read_again_until_once(pipe):
    pipe("\ufeffa,b\n1,2\n3")
    text = LiveText()
    assert [text.readline(), text.readline()] == ["a,b\n", "1,2\n"] and not text.pending()
    text.seek(0)
    assert text.readline() == "a,b\n"
    text.once()
    pipe(",4\n")
    assert [text.readline() for _ in range(3)] == ["a,b\n", "1,2\n", "3,4\n"]
    pipe("5")
    pipe(None)
    assert [text.readline(), text.readline()] == ["5", ""]


def test_a_log_from_a_pipe_is_read_as_its_rows_come(pipe):
    first = time_log.PREAMBLE_ROWS
    lines = rows(first + 40)
    pipe(HEADER + "".join(lines[:first]))
    with TimeLogFile("-") as log:
        assert log.live and log.sample_rate_Hz == pytest.approx(1000)
        blocks = log.blocks()
        got = [next(blocks)]
        while sum(map(len, got)) < first:
            got.append(next(blocks))
        assert sum(map(len, got)) == first
        for line in lines[first:]:
            pipe(line)
            got.append(next(blocks))
            assert len(got[-1]) == 1
        pipe(None)
        assert list(blocks) == [] and log.report.rows == first + 40
    expected = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    np.testing.assert_array_equal(np.concatenate(got)[:, :3], expected[:, :3])


def test_time_that_goes_back_is_refused_in_a_pipe_too(pipe):
    pipe("t_s,g1\n0,1\n1,1\n2,1\n1,1\n")
    pipe(None)
    with pytest.raises(FileFormatError, match="line 5, column t_s: time goes back from 2 to 1 s"):  # noqa: SIM117
        with TimeLogFile("-") as log:
            list(log.blocks())


@pytest.mark.slow
def test_estimates_of_a_pipe_are_those_of_the_file(tmp_path):
    lines = rows(3000)
    (tmp_path / "log.csv").write_text(HEADER + "".join(lines))
    command = [sys.executable, "-m", "papilla", "estimate"]
    subprocess.run([*command, "log.csv", "--out", "file.csv"], cwd=tmp_path, check=True, capture_output=True)
    with open(tmp_path / "log.csv") as stream:
        done = subprocess.run([*command, "-", "--out", "-"], cwd=tmp_path, stdin=stream, capture_output=True, text=True)
    assert done.returncode == 0
    assert [line.split(",")[0] for line in done.stdout.splitlines()[1:]] == [str(float(x.split(",")[0])) for x in lines]
    assert len((tmp_path / "file.csv").read_text().splitlines()) == len(done.stdout.splitlines())
    refused = subprocess.run([*command, "-", "--out", "-", "--json"], cwd=tmp_path, capture_output=True, text=True)
    assert refused.returncode == 2 and "--out - and --json both want standard output" in refused.stderr


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize(
    "number, code, word", [(signal.SIGTERM, 143, "terminated"), (signal.SIGINT, 130, "interrupted")]
)
def test_a_signal_ends_with_a_line_and_its_code(tmp_path, number, code, word):
    process = subprocess.Popen(
        [sys.executable, "-m", "papilla", "estimate", "-", "--out", "-"],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    process.stdin.write(HEADER + "".join(rows(300)))
    process.stdin.flush()
    assert process.stdout.readline().startswith("t_s,")
    process.stdout.readline()
    process.send_signal(number)
    _, said = process.communicate()
    assert process.returncode == 128 + number and said.splitlines()[-1] == f"papilla: {word}"


@pytest.mark.parametrize("end", ["", "\n"])
def test_a_line_without_end_is_refused_in_bounded_memory(end, monkeypatch):
    """The writer goes on for 40 MB, or until nobody reads: of a line without end no more than the bound is kept."""
    writer = (
        "import sys\nsys.stdout.write('t_s,g1\\n0,1\\n' + sys.argv[1])\nfor _ in range(640): print('1' * 65536, end='')"
    )
    with subprocess.Popen(
        [sys.executable, "-c", writer, end], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as process:
        monkeypatch.setattr(sys, "stdin", process.stdout)
        with pytest.raises(FileFormatError, match=f"^-, line {3 + bool(end)}: longer than 262144 bytes"):
            TimeLogFile("-")
        process.kill()


def test_a_column_has_the_name_that_its_file_gives_it(tmp_path):
    table = Table(tmp_path / "a.csv", {}, np.array([7]), {"force_N": "Fz"})
    assert str(table.fault(0, "force_N", "no")) == f"{tmp_path / 'a.csv'}, line 7, column Fz: no"


def test_a_file_is_read_in_pieces_and_the_line_of_a_fault_is_counted(tmp_path):
    path, content = tmp_path / "t.csv", b"0,1\n" * 40_000
    for asked, length in ((None, PIPE_CHUNK_BYTES), (0, PIPE_CHUNK_BYTES), (10, 10), (10**9, PIPE_CHUNK_BYTES)):
        assert ShortLines(io.BytesIO(content), path).read(asked) == content[:length]
    text = ShortLines(io.BytesIO(content[:-1] + b"\xff\n2"), path)
    assert text.line_without_text() == 40_000 and text.tell() > 2**16
    assert ShortLines(io.BytesIO(b"\xc3\xa9\n\n\xc3"), path).line_without_text() == 3
    for start in (0, 65_000):
        long = ShortLines(io.BytesIO(content[:start] + b"1" * LONGEST_TABLE_LINE + b"\r" + b"2" * 2**17), path)
        assert sum(len(piece) for piece in iter(long.read1, b"")) == start + LONGEST_TABLE_LINE + 1 + 2**17
        long = ShortLines(io.BytesIO(content[:start] + b"1" * (LONGEST_TABLE_LINE + 2**16) + b"\n"), path)
        with pytest.raises(FileFormatError, match=f"line {start // 4 + 1}: longer than 262144 bytes"):
            list(iter(long.read1, b""))


def test_lines_of_a_pipe_come_as_they_are_asked_for(pipe):
    pipe("a\nb\nc")
    text = LiveText()
    assert text.pending() and [text.readline() for _ in range(2)] == ["a\n", "b\n"] and not text.pending()
    text.seek(0)
    assert text.pending() and next(text) == "a\n"
    text.seek(0)
    text.once()
    text.seek(0)
    assert [text.readline(), text.readline()] == ["a\n", "b\n"]
    pipe("\n\u00e9")
    assert text.pending() and text.readline() == "c\n" and not text.pending()
    pipe(None)
    assert list(text) == ["\u00e9"] and not text.pending() and text.readline() == ""
