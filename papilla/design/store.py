"""The store of a study: one SQLite file that only the client writes; stored records are not computed again.

A record is found by the hash of its design, its scene, its objectives and the code that computes them, so studies on
one store share records. Write-ahead logging lets several clients use one store; each batch is one transaction.

Results are used as the store has them, so the file must belong to the user alone, and each row is checked when it is
read. A record that was forged with the right form is found when the chosen designs are judged again
(`papilla.design.results`).
"""

import json
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from papilla.core import checks
from papilla.core.errors import FileAccessError, FileFormatError, InputError, NotOwnError
from papilla.core.files import check_writable
from papilla.core.outside import json_value, own_database, reason
from papilla.design.batch import JudgedDesign
from papilla.design.study import Study
from papilla.design.texts import line, short

TRANSACTION_PATIENCE_S = 60.0
"""Time that a transaction waits for one of another client, s."""
MOST_BYTES = 2**20
"""Most bytes of a row or a cell; a row has 600."""
STORE_COLUMNS = {"records": ("key", "found", "status", "finger_sha256"), "designs": ("study", "number", "free", "key")}
CREATE_TABLES = """
CREATE TABLE IF NOT EXISTS records (key TEXT PRIMARY KEY, found TEXT NOT NULL, status TEXT NOT NULL,
    finger_sha256 TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS designs (study TEXT, number INTEGER, free TEXT NOT NULL, key TEXT NOT NULL,
    PRIMARY KEY (study, number)) WITHOUT ROWID;
"""

Row = tuple[int, dict[str, float], JudgedDesign]
"""A design of a study: number, values of its free parameters, record."""


class Store:
    """Records by key, and the designs of each study in their order.

    Raises `FileAccessError` if it cannot be read or written (records that were written before are safe), `NotOwnError`
    if others can write to it, and `FileFormatError` for a row that papilla did not write.
    """

    def __init__(self, path: Path):
        self.path, self.writes = path.absolute(), 0
        check_writable(path.parent)
        with self._faults():
            self._connection = own_database(self.path, TRANSACTION_PATIENCE_S)
            self._connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MOST_BYTES)
            self._connection.text_factory = bytes
            try:
                self._connection.execute("PRAGMA journal_mode=WAL")
                self._connection.execute("PRAGMA synchronous=NORMAL")
                self._connection.executescript(CREATE_TABLES)
                self._check_columns()
            except BaseException:
                self._connection.close()
                raise

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def holds(self, study: str) -> int:
        """Number of designs of a study in the store."""
        with self._faults():
            return int(self._connection.execute("SELECT count(*) FROM designs WHERE study = ?", (study,)).fetchone()[0])

    def known(self, numbers: Mapping[str, int], asked: Sequence[str]) -> dict[str, JudgedDesign]:
        """The records in the store of these objectives, by key. numbers : key -> number of a design that needs it."""
        marks = ",".join("?" * len(numbers))
        query = f"SELECT key, found, status, finger_sha256 FROM records WHERE key IN ({marks})"
        with self._faults():
            rows = self._connection.execute(query, list(numbers)).fetchall()
        return {(name := key.decode()): self._record(numbers[name], cells, asked) for key, *cells in rows}

    def add(self, study: str, rows: Sequence[tuple[int, dict[str, float], str, JudgedDesign]]) -> None:
        """Add designs (number, values of free parameters, key, record) of a study in one transaction."""
        with self._faults(), self._transaction():
            self._connection.executemany(
                "INSERT OR IGNORE INTO records VALUES (?, ?, ?, ?)",
                [(key, _text(record.found), record.status, record.finger_sha256) for _, _, key, record in rows],
            )
            self._connection.executemany(
                "INSERT OR REPLACE INTO designs VALUES (?, ?, ?, ?)",
                [(study, number, _text(free), key) for number, free, key, _ in rows],
            )
        self.writes += 1

    def rows(self, study: Study) -> Iterator[Row]:
        """The designs of a study in their order, each checked."""
        query = """SELECT number, free, found, status, finger_sha256 FROM designs LEFT JOIN records USING (key)
            WHERE study = ? ORDER BY number"""
        before = -1
        with self._faults():
            for number, free, *cells in self._connection.execute(query, (study.sha256,)):
                if not isinstance(number, int) or not before < number < study.most_designs:
                    raise self.fault(number, f"the study has designs 0 to {study.most_designs - 1}, each once")
                before = number
                yield number, self._free(number, free, study), self._record(number, cells, study.asked)

    def fault(self, number: object, what: object) -> FileFormatError:
        """The error of a design whose row papilla did not write so."""
        return FileFormatError(
            f"{self.path}: design {short(line(number))}: {short(line(what), 300)}; papilla did not write this row, "
            "or it was damaged: move the store away and run the study again"
        )

    def _free(self, number: int, cell: object, study: Study) -> dict[str, float]:
        try:
            free = _value(cell, "its values of free parameters")
            study.check_free(free)
        except InputError as error:
            raise self.fault(number, error) from error
        return free

    def _record(self, number: int, cells: Sequence[object], asked: Sequence[str]) -> JudgedDesign:
        """A record of its cells: values, status, sha256 of the finger."""
        values, *texts = cells
        try:
            if values is None:
                raise InputError("its record is missing")
            status, sha256 = (_string(cell) for cell in texts)
            record = JudgedDesign(_value(values, "its values of objectives"), status, sha256)
            record.check(asked)
        except InputError as error:
            raise self.fault(number, error) from error
        return record

    def _check_columns(self) -> None:
        for table, columns in STORE_COLUMNS.items():
            rows = self._connection.execute("SELECT name FROM pragma_table_info(?)", (table,))
            if tuple(name.decode() for (name,) in rows) != columns:
                raise FileFormatError(
                    f"{self.path} is no store of this papilla: its table {table} has other columns, as "
                    "those of earlier versions; move it away, or name another one"
                )

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        self._connection.execute("BEGIN IMMEDIATE")
        try:
            yield
            self._connection.execute("COMMIT")
        except BaseException:
            if self._connection.in_transaction:
                self._connection.execute("ROLLBACK")
            raise

    @contextmanager
    def _faults(self) -> Iterator[None]:
        try:
            yield
        except NotOwnError as error:
            raise NotOwnError(f"{error}: a store must be yours alone, as its results are used (chmod go-w)") from error
        except FileAccessError:
            raise
        except (sqlite3.Error, OSError) as error:
            why = reason(error) if isinstance(error, OSError) else short(line(error), 200)
            raise FileAccessError(
                f"cannot use the store {self.path}: {why}; what was stored before is kept, --resume goes on from it"
            ) from error


def _text(values: dict[str, float]) -> str:
    return json.dumps(values, allow_nan=False)


def _value(cell: object, what: str) -> dict[str, float]:
    if not isinstance(cell, bytes):
        raise InputError(f"{what} are no text")
    values = json_value(cell, what)
    if not isinstance(values, dict):
        raise InputError(f"{what} are no table")
    return {name: checks.finite(short(line(name)), value) for name, value in values.items()}


def _string(cell: object) -> str:
    try:
        return cell.decode() if isinstance(cell, bytes) else ""
    except UnicodeDecodeError as error:
        raise InputError("its status is no text in UTF-8") from error
