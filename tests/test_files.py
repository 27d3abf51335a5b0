"""Atomic files and tables: the whole new file or the old one, and nothing left beside it."""

import errno
import os

import numpy as np
import pytest

from papilla.errors import FileAccessError, InputError
from papilla.files import check_writable, replacing, write_text
from papilla.tables import write_table


def test_replaces_the_file_and_leaves_nothing_beside_it(tmp_path):
    target = tmp_path / "note.txt"
    write_text(target, "one")
    write_text(target, "two")
    assert target.read_text() == "two"
    assert list(tmp_path.iterdir()) == [target]


def test_keeps_the_old_file_when_writing_fails(tmp_path):
    target = tmp_path / "note.txt"
    write_text(target, "old")
    with pytest.raises(RuntimeError), replacing(target) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_full_disk_is_one_clear_line(tmp_path):
    with (
        pytest.raises(FileAccessError, match=r"cannot write .*note.txt: No space left"),
        replacing(tmp_path / "note.txt"),
    ):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_follows_a_link_instead_of_replacing_it(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "real")
    write_text(tmp_path / "link", "text")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "real").read_text() == "text"


@pytest.mark.parametrize("name", ["missing/note.txt", "folder"])
def test_refuses_where_no_file_can_be(tmp_path, name):
    (tmp_path / "folder").mkdir()
    with pytest.raises(FileAccessError, match="cannot write"):
        write_text(tmp_path / name, "text")


def test_check_writable_makes_the_folder_and_leaves_it_empty(tmp_path):
    check_writable(tmp_path / "a" / "b")
    assert list((tmp_path / "a" / "b").iterdir()) == []


def test_check_writable_refuses_a_folder_below_a_file(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(FileAccessError, match="cannot write to folder .*file/out: Not a directory"):
        check_writable(tmp_path / "file" / "out")


def test_columns_of_a_table_must_be_equally_long(tmp_path):
    with pytest.raises(InputError, match=r"equally long, got \{'a': 2, 'b': 3\}"):
        write_table(tmp_path / "t.csv", {"a": np.zeros(2), "b": np.zeros(3)})
    assert list(tmp_path.iterdir()) == []


def test_table_of_numbers_and_text(tmp_path):
    write_table(tmp_path / "t.csv", {"x": np.array([0.1, np.nan]), "n": np.array([1, 2]), "status": ["ok", 'a "b", c']})
    assert (tmp_path / "t.csv").read_bytes() == b'x,n,status\n0.1,1,ok\n,2,"a ""b"", c"\n'
