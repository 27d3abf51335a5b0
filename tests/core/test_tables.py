"""Tables of numbers: what is written is read back bit for bit, in every dialect, and each fault has its place."""

import json

import numpy as np
import pytest

from papilla.core.errors import FileFormatError, InputError
from papilla.core.rows import LONGEST_CELL
from papilla.core.sealed import EDITED_MESSAGE, NO_CHECKSUM, read_sealed, write_sealed
from papilla.core.status import Status
from papilla.core.tables import CUT_OFF_MESSAGE, MAX_COLUMNS, TableReader, closest, table_writer, write_table


def drawn(seed, rows=50):
    """Columns of numbers of every size, with gaps, and one of words."""
    rng = np.random.default_rng(seed)
    numbers = rng.normal(size=(3, rows)) * 10.0 ** rng.integers(-300, 300, (3, rows))
    numbers[0, rng.integers(rows, size=5)] = np.nan
    return {**dict(zip(("a", "b", "c"), numbers, strict=True)), "word": [f'w "{k}", é' for k in range(rows)]}


def read(path, wanted=lambda name: True, words=("word",), size=7, **dialect):
    """All blocks of a table as one, and the reader."""
    with TableReader(path, wanted, words, **dialect) as reader:
        blocks = list(reader.blocks(size))
        assert {len(block) for block in blocks[:-1]} <= {size} and blocks[-1].lines[-1] >= blocks[-1].lines[0]
        return {name: np.concatenate([block.columns[name] for block in blocks]) for name in reader.names}, reader


@pytest.mark.parametrize("seed", range(3))
def test_what_is_written_is_read_back_bit_for_bit(tmp_path, seed):
    columns = drawn(seed)
    write_table(tmp_path / "t.csv", columns)
    found, reader = read(tmp_path / "t.csv")
    assert list(found) == reader.header == list(columns) and found["word"].tolist() == columns["word"]
    for name in ("a", "b", "c"):
        assert found[name].tobytes() == columns[name].tobytes() or np.array_equal(found[name], columns[name], True)
    some, reader = read(tmp_path / "t.csv", lambda name: name in "bc", ())
    assert (
        list(some) == ["b", "c"] and reader.ignored == ("a", "word") and reader.notes == ("ignored columns: a, word",)
    )
    with TableReader(tmp_path / "t.csv", lambda name: True, ("word",)) as reader:
        whole = reader.whole()
    assert len(whole) == 50 and whole.lines.tolist() == list(range(2, 52))
    assert str(whole.fault(3, "b", "no")) == f"{tmp_path / 't.csv'}, line 5, column b: no"


def test_a_table_is_plain_csv_and_its_columns_are_equally_long(tmp_path):
    write_table(tmp_path / "t.csv", {"x": np.array([0.1, np.nan]), "n": np.array([1, 2]), "status": ["ok", 'a "b", c']})
    assert (tmp_path / "t.csv").read_bytes() == b'x,n,status\n0.1,1,ok\n,2,"a ""b"", c"\n'
    with pytest.raises(InputError, match=r"equally long, got \{'a': 2, 'b': 3\}"):
        write_table(tmp_path / "u.csv", {"a": np.zeros(2), "b": np.zeros(3)})
    assert [path.name for path in tmp_path.iterdir()] == ["t.csv"]


@pytest.mark.parametrize(
    "text, notes",
    [
        ("t,x\n0,1.5\n1,\n2,-3e2\n", ()), ("\ufefft,x\r\n0,1.5\r\n1,nan\r\n2,-300\r\n", ()),
        ("t;x\n0;1,5\n1;\n2;-3,0e2\n", ("cells are separated by semicolons, decimal commas",)),
        ("t\tx\n0\t1.5\n1\t\n2\t-300\n", ("cells are separated by tabs",)),
        ('"t","x"\n"0","1.5"\n"1",""\n2,-300\n', ()),
        ("t,x\n0,1.5\n1,\n2,-300", (CUT_OFF_MESSAGE,)),
    ],
)  # fmt: skip
def test_every_dialect_gives_the_same_numbers(tmp_path, text, notes):
    (tmp_path / "t.csv").write_bytes(text.encode())
    found, reader = read(tmp_path / "t.csv", words=())
    np.testing.assert_array_equal([found["t"], found["x"]], [[0, 1, 2], [1.5, np.nan, -300]])
    assert reader.notes == notes


def test_a_header_may_stand_lower_and_have_units_below_it(tmp_path):
    (tmp_path / "t.csv").write_text("made by X\nt,Fz\n(s),N\n0,1\n1,2\n")
    how = {"header_line": 2, "is_unit": lambda cell: cell in ("s", "N")}
    found, reader = read(tmp_path / "t.csv", words=(), **how)
    assert reader.header == ["t [s]", "Fz [N]"] and found["Fz [N]"].tolist() == [1, 2]


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "is empty or starts with an empty line"), ("a,b\n", "holds a header but no rows"),
        ("a,b\n1,2\n1\n", "line 3: 1 cells where the header has 2 columns"),
        ("a,a\n1,2\n", "line 1: column a occurs twice"),
        ("a,\n1,2\n", "line 1: column 2 has no name"),
        ("a,b\n1,2\n1,x\n", "line 3, column b: expected a number, got 'x'"),
        ("a,b\n1,1_0\n", "line 2, column b: expected a number, got '1_0'"), ('a,b\n1,"2\n', "not readable as CSV"),
        (",".join(f"c{k}" for k in range(MAX_COLUMNS + 1)) + "\n", "1001 columns; no table of papilla has more"),
        ("a" * (LONGEST_CELL + 1) + ",b\n1,2\n", "a column's name has 1001 characters"),
        ("a\n1\n\xff\n", "not a text file"),
        ("a,b\n1,2\n" + "1," * 2**18, "line 3: longer than 262144 bytes"),
        ("a,word\n1," + "w" * 1001 + "\n", "column word: a text of 1001 characters; at most 1000 are one"),
    ],
    ids=lambda value: value[:30].encode("unicode_escape").decode(),
)  # fmt: skip
def test_a_fault_has_its_place(tmp_path, text, message):
    (tmp_path / "t.csv").write_bytes(text.encode("latin-1"))
    with pytest.raises(FileFormatError, match="t.csv") as refused:
        read(tmp_path / "t.csv")
    assert message in str(refused.value)


def test_a_misspelt_name_has_one_that_is_close():
    assert closest("Thicknes_mm", ["thickness_mm", "force_N"]) == "thickness_mm"
    assert closest("x", ["force_N"]) is None and closest("abcdefgh", ["abcdeXYh"]) is None
    assert closest("abcdefghij", ["abcdefghXY", "ABCDEFGHXY"]) is not None


def test_a_sealed_document_says_whether_it_was_edited(tmp_path):
    path, document = tmp_path / "d.json", {"schema": "x/1", "rows": [[1.0, 2.5], [3.0, 4.0]], "name": "µ"}
    write_sealed(document, path)
    assert read_sealed(path, "x/1", "thing") == (document, "") and "[1.0, 2.5]" in path.read_text(encoding="utf-8")
    content = json.loads(path.read_text(encoding="utf-8"))
    for changed, remark in (
        (dict(reversed(content.items())), ""),
        (content | {"name": "m"}, EDITED_MESSAGE),
        (document, NO_CHECKSUM),
    ):
        path.write_text(json.dumps(changed))
        assert read_sealed(path, "x/1", "thing")[1] == remark
    for text in ('{"schema": "x/2"}', "[1]"):
        path.write_text(text)
        with pytest.raises(FileFormatError, match="d.json: the schema is .* reads 'x/1'"):
            read_sealed(path, "x/1", "thing")


class Answer(Status):
    """Three statuses."""

    OK = "ok"
    FAR_OFF = "ok, but far"
    NO_CONTACT = "no contact: press harder"


def test_a_status_counts_from_zero_and_is_printed_by_name():
    assert [int(one) for one in Answer] == [0, 1, 2] and [one.good for one in Answer] == [True, True, False]
    assert [one.code for one in Answer] == ["ok", "ok, far off", "no contact"]
    assert f"{Answer.NO_CONTACT} {Answer.NO_CONTACT:d}" == "NO_CONTACT 2" and str(Answer.OK) == "OK"
    assert (
        Answer.in_words(np.array([2, 0])) == ["no contact: press harder", "ok"] and Answer.in_words(1) == "ok, but far"
    )


@pytest.mark.parametrize("size", [2, 3, 100])
def test_the_line_of_a_fault_is_that_of_the_file_in_every_block(tmp_path, size):
    """Below a line above the header, an empty line, and a quoted cell of two lines."""
    lines = ["made by X", "a,word", *(f"{k},w" for k in range(4)), "", '4,"x', 'y"', "5,w", "oops,w"]
    (tmp_path / "t.csv").write_text("\n".join([*lines[:-1], "6,w", ""]))
    with TableReader(tmp_path / "t.csv", lambda name: True, ("word",), header_line=2) as reader:
        blocks = list(reader.blocks(size))
    assert max(map(len, blocks)) <= size and np.concatenate([block.columns["a"] for block in blocks]).tolist() == [
        *range(7)
    ]
    assert np.concatenate([block.lines for block in blocks]).tolist() == [3, 4, 5, 6, 9, 10, 11]
    for wanted, words in (("aword", ("word",)), ("a", ())):
        (tmp_path / "t.csv").write_text("\n".join([*lines, ""]))
        with pytest.raises(FileFormatError, match="line 11, column a: expected a number, got 'oops'"):
            read(tmp_path / "t.csv", lambda name, wanted=wanted: name in wanted, words, size, header_line=2)
    (tmp_path / "t.csv").write_text("only\n")
    with pytest.raises(FileFormatError, match="ends above line 3, where its header should be"):
        read(tmp_path / "t.csv", header_line=3)
    (tmp_path / "t.csv").write_text("x\n\n1\n")
    with pytest.raises(FileFormatError, match="has nothing in line 2"):
        read(tmp_path / "t.csv", header_line=2)


def test_a_point_among_decimal_commas_is_no_number_and_the_header_chooses_the_delimiter(tmp_path):
    (tmp_path / "t.csv").write_text("t;x\n0;1,5\n1;1.234,5\n")
    with pytest.raises(FileFormatError, match="line 3, column x: expected a number, got '1.234,5'"):
        read(tmp_path / "t.csv", words=())
    (tmp_path / "t.csv").write_text('"a,b";c\n1,5;2\n')
    columns, reader = read(tmp_path / "t.csv", words=())
    assert reader.header == ["a,b", "c"] and columns["a,b"].tolist() == [1.5]
    (tmp_path / "t.csv").write_text("a;b,c\n1,2\n")
    assert read(tmp_path / "t.csv", words=())[1].header == ["a;b", "c"]
    (tmp_path / "t.csv").write_text("a,b\n1,2\n")
    columns, reader = read(tmp_path / "t.csv", words=(), delimiter=",", decimal=".")
    assert columns["b"].tolist() == [2] and reader.notes == ()


def test_standard_output_gets_a_table_block_by_block(capsys):
    with table_writer("-", ("a", "b")) as write:
        write([np.array([0.1, np.nan]), ["x", None]])
        assert capsys.readouterr().out == "a,b\n0.1,x\n,\n"
        write([np.array([np.nan]), np.array([3])])
    assert capsys.readouterr().out == ",3\n"


def test_a_message_is_one_line_of_bounded_length():
    """A longer one is left out in the middle, and what is left of it is no longer line."""
    for letters in (2000, 2001, 9001):
        text = "".join(chr(97 + k % 26) for k in range(letters))
        line = str(InputError(text))
        assert len(line) <= 2000 and (line == text) == (letters == 2000)
        if letters > 2000:
            assert line == f"{text[:950]} ... ({letters - 1900} characters) ... {text[-950:]}"
    assert str(InputError("a\r\n\t b\x1b[0m ")) == r"a b\x1b[0m"
