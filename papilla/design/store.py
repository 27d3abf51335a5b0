"""The store of a study: one SQLite file that only the client writes; stored records are not computed again.

A record is found by the hash of its design, its scene, its objectives and the code that computes them, so studies on
one store share records. Write-ahead logging lets several clients use one store; each batch is one transaction.
"""

import json
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from papilla.core.errors import FileAccessError
from papilla.core.files import check_writable
from papilla.design.batch import Record

PATIENCE_S = 60.0
"""Time that a transaction waits for one of another client, s."""
TABLES = """
CREATE TABLE IF NOT EXISTS records (key TEXT PRIMARY KEY, found TEXT NOT NULL, status TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS designs (study TEXT, number INTEGER, free TEXT NOT NULL, key TEXT NOT NULL,
    PRIMARY KEY (study, number)) WITHOUT ROWID;
"""


class Store:
    """Records by key, and the designs of each study in their order. Raises `FileAccessError` if it cannot be read or
    written; records that were written before are safe."""

    def __init__(self, path: Path):
        self.path, self.writes = path, 0
        check_writable(path.parent)
        with self._faults():
            self._connection = sqlite3.connect(path, timeout=PATIENCE_S, isolation_level=None)
            self._connection.execute("PRAGMA journal_mode=WAL")
            self._connection.execute("PRAGMA synchronous=NORMAL")
            self._connection.executescript(TABLES)

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def holds(self, study: str) -> int:
        """Number of designs of a study in the store."""
        with self._faults():
            return int(self._connection.execute("SELECT count(*) FROM designs WHERE study = ?", (study,)).fetchone()[0])

    def known(self, keys: Sequence[str]) -> dict[str, Record]:
        """The records in the store with these keys."""
        marks = ",".join("?" * len(keys))
        with self._faults():
            rows = self._connection.execute(
                f"SELECT key, found, status FROM records WHERE key IN ({marks})", list(keys)
            )
            return {key: Record(json.loads(found), status) for key, found, status in rows}

    def add(self, study: str, rows: Sequence[tuple[int, dict[str, float], str, Record]]) -> None:
        """Add designs (number, values of free parameters, key, record) of a study in one transaction."""
        with self._faults(), self._transaction():
            self._connection.executemany(
                "INSERT OR IGNORE INTO records VALUES (?, ?, ?)",
                [(key, json.dumps(record.found), record.status) for _, _, key, record in rows],
            )
            self._connection.executemany(
                "INSERT OR REPLACE INTO designs VALUES (?, ?, ?, ?)",
                [(study, number, json.dumps(free), key) for number, free, key, _ in rows],
            )
        self.writes += 1

    def rows(self, study: str) -> Iterator[tuple[int, dict[str, float], Record]]:
        """The designs of a study in their order: number, values of free parameters, record."""
        query = """SELECT number, free, found, status FROM designs JOIN records USING (key)
            WHERE study = ? ORDER BY number"""
        with self._faults():
            for number, free, found, status in self._connection.execute(query, (study,)):
                yield number, json.loads(free), Record(json.loads(found), status)

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
        except sqlite3.Error as error:
            raise FileAccessError(
                f"cannot use the store {self.path}: {error}; what was stored before is kept, --resume goes on from it"
            ) from error
