"""A map that papilla proposes is a map that papilla reads, whatever the header holds."""

import csv
import random

import pytest

from papilla.core.errors import PapillaError
from papilla.logs import TimeLogFile
from papilla.logs.log_map import LogMap
from papilla.logs.proposal import propose

HEADERS = 400
WORDS = (
    "time", "t [ms]", "Fz [N]", "Force", "ch1", "ch 2", "strain 3 (mV/V)", "g", "g0", "SG_4", "load / gf", "speed_mm_s",
    "E [kPa]", "room", "/ft:force.z", "/gauges", "/a:", "position", "counts (V)", "g1000", "stamp", "force[0]",
)  # fmt: skip
MARKS = (
    "\n", "\r\n", "\r", '"', "'", "'''", '"""', "\\", "\\u0041", "\t", "\x01", "\x07", "\x1b[31m", "\x7f", "\x85",
    "\u2028", "\u202e", "é", "µ", "温度", "😀", "[", "]", "[columns]", "{", "}", "#", "=", " = 3\n[map]\nx = ",
    ";", ",", "(", ")", " ", "x" * 300, "9" * 30, "_" * 200, "%s", "$(id)", "\ufeff",
)  # fmt: skip


def odd_header(rng: random.Random) -> list[str]:
    """Names of two to six columns: known words, with marks before, inside and behind; some empty, long or alike."""
    names = rng.choices(WORDS, k=rng.randint(2, 6))
    for number in rng.choices(range(len(names)), k=rng.randint(0, 8)):
        place = rng.randint(0, len(names[number]))
        names[number] = names[number][:place] + rng.choice(MARKS) + names[number][place:]
    if rng.random() < 0.1:
        names[rng.randrange(len(names))] = rng.choice(("", "y" * 5000, names[0]))
    return names


def test_odd_headers_are_refused_in_one_line_or_read_back(tmp_path):
    rng, read = random.Random(38), 0
    for case in range(HEADERS):
        names = odd_header(rng)
        with open(tmp_path / "log.csv", "w", encoding="utf-8", newline="") as text:
            writer = csv.writer(text, delimiter=rng.choice(",,;\t"), lineterminator=rng.choice(("\n", "\r\n")))
            writer.writerow(names)
            writer.writerows([[f"{row / 1e3 + column:.3f}" for column in range(len(names))] for row in range(30)])
        try:
            text = propose(tmp_path / "log.csv").to_toml()
        except PapillaError as refused:
            assert "\n" not in str(refused) and len(str(refused)) < 2000, (case, names)
            continue
        (tmp_path / "map.toml").write_text(text, encoding="utf-8", newline="")
        proposed = LogMap.load(tmp_path / "map.toml")
        # A byte order mark at the beginning of a file is none of the first name
        stripped = [name.strip() for name in (names[0].removeprefix("\ufeff"), *names[1:])]
        assert {column.name for column in proposed.columns.values()} <= {*stripped}, (case, names)
        assert all(line.isprintable() for line in text.split("\n")), (case, names)
        if "t_s" in proposed.columns and any(name.startswith("g") for name in proposed.columns):
            with TimeLogFile(tmp_path / "log.csv", log_map=tmp_path / "map.toml") as log:
                assert log.report.rows == 30, (case, names)
            read += 1
    assert read > 0.1 * HEADERS


@pytest.mark.parametrize(
    "head, why",
    [
        ("time,ch1,ch1", "line 1: column ch1 occurs twice"),
        ("time,,ch1", "line 1: column 2 has no name"),
        (f"time,{'y' * 5000},ch1", "line 1: a column's name has 5000 characters"),
        ("0,1,2", "no row of names above rows of numbers"),
    ],
)
def test_a_row_of_numbers_does_not_become_the_header_in_its_place(tmp_path, head, why):
    (tmp_path / "log.csv").write_text(f"{head}\n0,1,5.5\n0.01,2,6.5\n0.02,3,7.5\n")
    with pytest.raises(PapillaError, match=why):
        propose(tmp_path / "log.csv")


@pytest.mark.parametrize("head", ['time,"Force\r\n[N]",ch1', '"time",Force [N],"ch1\n# x = 1"'])
def test_a_name_over_two_lines_costs_no_row(tmp_path, head):
    (tmp_path / "log.csv").write_bytes(f"{head}\n0,1,5.5\n0.01,2,6.5\n0.02,3,7.5\n".encode())
    proposed = propose(tmp_path / "log.csv")
    (tmp_path / "log_map.toml").write_text(proposed.to_toml(), newline="")
    assert {guess.meant for guess in proposed.guesses} == {"t_s", "force_N", "g1"}
    with TimeLogFile(tmp_path / "log.csv") as log:
        assert log.report.rows == 3


def test_the_name_of_a_log_stays_inside_its_comment(tmp_path):
    path = tmp_path / "a\n[columns]\nx = 1.csv"
    path.write_text("time,ch1\n0,1\n1,2\n")
    (tmp_path / "map.toml").write_text(propose(path).to_toml())
    assert {*LogMap.load(tmp_path / "map.toml").columns} == {"t_s", "g1"}
