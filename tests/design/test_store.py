"""The store of a study: who owns it, what its rows must be, and what two clients and a full disk do to it."""

import json
import os
import resource
import sqlite3
from contextlib import closing

import numpy as np
import pytest

from papilla.core.errors import FileAccessError, FileFormatError, NotOwnError, PapillaError
from papilla.design.batch import JudgedDesign
from papilla.design.results import Results
from papilla.design.store import Store
from papilla.design.study import read_study

GOOD = {"sigma_sd": 0.3, "signal_over_noise": 5.0}


def rows_of(study, count=12):
    """Designs with made-up records; the last has no answer."""
    rows = []
    for number in range(count):
        free = {one.name: one.at(number / count) for one in study.free}
        record = JudgedDesign({name: value + number for name, value in GOOD.items()}, "ok", f"{number:064x}")
        rows.append((number, free, f"k{number}", record if number < count - 1 else JudgedDesign.failed("no mesh")))
    return rows


@pytest.fixture
def stored(study_file, tmp_path):
    """A study, and the file of a store with its designs."""
    study, path = read_study(study_file()), tmp_path / "store.sqlite"
    with closing(Store(path)) as store:
        store.add(study.sha256, rows_of(study))
    return study, path


def changed(path, *commands):
    """Change the file as anybody with a tool for databases may."""
    with closing(sqlite3.connect(path)) as connection:
        for command in commands:
            connection.execute(*([command] if isinstance(command, str) else command))
        connection.commit()


def test_what_was_written_is_read(stored):
    study, path = stored
    with closing(Store(path)) as store:
        expected = [(number, free, record) for number, free, _, record in rows_of(study)]
        assert list(store.rows(study)) == expected and store.holds(study.sha256) == 12
        assert store.known({"k3": 3, "unknown": 4}, study.asked) == {"k3": expected[3][2]}


def cell(table, column, value, number=3):
    """A command that changes a cell of a design."""
    where = "key = ?" if table == "records" else "number = ?"
    return f"UPDATE {table} SET {column} = ? WHERE {where}", (value, f"k{number}" if table == "records" else number)


BROKEN = {
    "no JSON": cell("records", "found", "sigma"),
    "a value is missing": cell("records", "found", '{"sigma_sd": 0.3}'),
    "another objective": cell("records", "found", '{"sigma_sd": 0.3, "sigma_gauges": 1.0}'),
    "not a number": cell("records", "found", '{"sigma_sd": NaN, "signal_over_noise": 5.0}'),
    "nested": cell("records", "found", "[" * 100_000),
    "a status without end": cell("records", "status", "x" * 100_000),
    "a status of bytes": cell("records", "status", b"\xff"),
    "an answer of a failure": cell("records", "status", "ok", 11),
    "no record": ("DELETE FROM records WHERE key = 'k3'", ()),
    "other free parameters": cell("designs", "free", '{"inner.nu": 0.3, "gauges.spread_deg": 30.0}'),
    "outside": cell("designs", "free", '{"outer.modulus_MPa": 0.3, "gauges.spread_deg": 50.1}'),
    "above all numbers": cell("designs", "number", 12),
}


@pytest.mark.parametrize("command", BROKEN.values(), ids=BROKEN)
def test_a_row_that_papilla_did_not_write_is_one_line(stored, command):
    study, path = stored
    changed(path, command)
    with closing(Store(path)) as store, pytest.raises(FileFormatError) as refused:
        Results.of(study, store)
    said = str(refused.value)
    assert said.startswith(f"{path}: design ") and said.endswith("move the store away and run the study again")
    assert "\n" not in said and len(said) < 1000


@pytest.mark.parametrize("seed", range(40))
def test_any_changed_cell_is_read_as_it_was_or_refused(stored, seed):
    """A few letters of a cell change: what is read is a valid design, or the error names the store."""
    study, path = stored
    rng = np.random.default_rng(seed)
    table, column = [("records", "found"), ("records", "status"), ("designs", "free")][seed % 3]
    key = "key = 'k4'" if table == "records" else "number = 4"
    with closing(sqlite3.connect(path)) as connection:
        text = bytearray(connection.execute(f"SELECT {column} FROM {table} WHERE {key}").fetchone()[0].encode())
    for _ in range(rng.integers(1, 4)):
        text[rng.integers(len(text))] = rng.choice([*b'0123456789{}[]",:.-e\\ nulNaI', 0, 10, 255])
    changed(path, (f"UPDATE {table} SET {column} = CAST(? AS TEXT) WHERE {key}", (bytes(text),)))
    with closing(Store(path)) as store:
        try:
            for _, free, record in store.rows(study):
                assert all(one.holds(free[one.name]) for one in study.free)
                assert record.status != "ok" or (
                    set(record.found) == set(GOOD) and np.isfinite([*record.found.values()]).all()
                )
        except PapillaError as refused:
            assert str(path) in str(refused) and "\n" not in str(refused)


FORGED = json.dumps({"sigma_sd": 1e-9, "signal_over_noise": 1e9})
BEST = "UPDATE records SET found = ? WHERE key = (SELECT key FROM designs WHERE number = 5)"


@pytest.mark.parametrize(
    "command, said",
    [
        ((BEST, (FORGED,)), "design 5: sigma_sd is 1e-09 there, and 0.* when it is judged again"),
        (("UPDATE records SET finger_sha256 = ?", ("0" * 64,)), "its record is of another finger"),
    ],
)
def test_a_forged_record_is_noticed_before_anything_is_written(ran, tmp_path, command, said):
    ran()
    for path in (tmp_path / "out").glob("*.toml"):
        path.unlink()
    store = tmp_path / "out" / "store.sqlite"
    changed(store, command)
    with pytest.raises(FileFormatError, match=said) as refused:
        ran(resume=True)
    assert str(store) in str(refused.value) and not list((tmp_path / "out").glob("*.toml"))


@pytest.mark.parametrize("mode, ending", [(0o620, ""), (0o602, ""), (0o666, "-wal")])
def test_a_store_that_others_can_write_to_is_refused(stored, mode, ending):
    _, path = stored
    place = path.with_name(path.name + ending)
    place.touch()
    place.chmod(mode)
    with pytest.raises(NotOwnError, match="others can write to .*must be yours alone"):
        Store(path)


def test_a_new_store_is_for_its_user_alone(tmp_path):
    before = os.umask(0)
    try:
        Store(tmp_path / "store.sqlite").close()
    finally:
        os.umask(before)
    assert (tmp_path / "store.sqlite").stat().st_mode & 0o777 == 0o600


def test_a_full_store_is_one_line_and_keeps_what_it_has(stored):
    study, path = stored
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    more = [(number, {}, f"more{number}", JudgedDesign.failed("w" * 500)) for number in range(12, 2000)]
    with closing(Store(path)) as store:
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, hard))
        try:
            with pytest.raises(FileAccessError, match=r"cannot use the store .*--resume goes on from it"):
                store.add(study.sha256, more)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    with closing(Store(path)) as again:
        assert [row[0] for row in again.rows(study)] == list(range(12))


def test_a_file_that_is_no_store_is_one_line(tmp_path):
    text, other = tmp_path / "a.sqlite", tmp_path / "b.sqlite"
    text.write_text("this is no database, but text that is long enough for a header" * 9)
    changed(other, "CREATE TABLE records (key TEXT PRIMARY KEY, found TEXT, status TEXT)")
    for path, message in (
        (text, "not a database"),
        (other, "no store of this papilla: its table records has other columns"),
        (tmp_path, "cannot use the store"),
    ):
        path.chmod(0o700 if path.is_dir() else 0o600)
        with pytest.raises(PapillaError, match=message):
            Store(path)


def test_two_clients_write_to_one_store(stored, study_file):
    """A record that is stored stays: the second client's record of the same key is not taken."""
    study, path = stored
    other = read_study(study_file(("made up", "another")))
    with closing(Store(path)) as one, closing(Store(path)) as two:
        number, free, key, record = rows_of(study)[2]
        two.add(other.sha256, [(number, free, key, JudgedDesign(dict.fromkeys(GOOD, 9.0), "ok", "a" * 64))])
        assert [row[2] for row in one.rows(other)] == [record]
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("PRAGMA journal_mode").fetchone() == ("wal",)
