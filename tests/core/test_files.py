"""Atomic files and tables: the whole new file or the old one, and nothing left beside it."""

import errno
import os
import subprocess
import sys

import numpy as np
import pytest

from papilla.core import files
from papilla.core.errors import FileAccessError, InputError
from papilla.core.files import check_writable, replacing, replacing_set, scratch, write_text
from papilla.core.tables import write_table


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


@pytest.mark.skipif(os.name == "nt", reason="permissions of POSIX")
@pytest.mark.parametrize("mode", [0o600, 0o640, 0o444])
def test_rewriting_keeps_the_permissions(tmp_path, mode):
    target = tmp_path / "note.txt"
    target.write_text("old")
    target.chmod(mode)
    with replacing(target) as temporary:
        assert temporary.stat().st_mode & 0o777 == 0o600, "nobody else reads it while it is written"
        temporary.write_text("new")
    assert target.read_text() == "new" and target.stat().st_mode & 0o777 == mode


def test_a_set_is_written_whole(tmp_path):
    paths = [tmp_path / name for name in ("a", "b", "c")]
    for text in ("one", "two"):
        with replacing_set(paths) as temporaries:
            for temporary in temporaries:
                temporary.write_text(text)
            assert all(not path.exists() or path.read_text() == "one" for path in paths)
        assert [path.read_text() for path in paths] == [text] * 3
    assert sorted(tmp_path.iterdir()) == paths


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left"), ValueError("no"), KeyboardInterrupt()])
def test_a_set_that_fails_leaves_the_old_one(tmp_path, error):
    paths = [tmp_path / name for name in ("a", "b")]
    for path in paths:
        path.write_text("old")
    with pytest.raises((FileAccessError, ValueError, KeyboardInterrupt)), replacing_set(paths) as temporaries:
        temporaries[0].write_text("new")
        raise error
    assert [path.read_text() for path in paths] == ["old"] * 2
    assert sorted(tmp_path.iterdir()) == paths


def test_what_writes_atomically_may_write_a_file_of_a_set(tmp_path):
    paths = [tmp_path / "a", tmp_path / "b"]
    with replacing_set(paths) as (first, second):
        write_text(first, "one")
        write_text(second, "two")
        assert not any(path.exists() for path in paths)
    assert [path.read_text() for path in paths] == ["one", "two"]
    for named, shown in ((True, f"{paths[1]}"), (False, f"{paths[0]}, {paths[1]}")):
        refused = pytest.raises(FileAccessError, match=f"^cannot write {shown}: No space left$")
        with refused, replacing_set(paths) as (_, second), replacing(second):
            raise OSError(errno.ENOSPC, "No space left", *([str(second)] if named else []))
    assert [path.read_text() for path in paths] == ["one", "two"] and sorted(tmp_path.iterdir()) == paths


@pytest.mark.parametrize("steps", range(8))
def test_no_file_of_a_new_set_stands_beside_one_of_the_old(tmp_path, monkeypatch, steps):
    """Whatever step of the exchange the process is killed before."""
    paths = [tmp_path / name for name in ("a", "b", "c")]
    for path in paths:
        path.write_text("old")
    left = steps

    class Killed(BaseException):
        pass

    def dies(call):
        def step(*arguments, **more):
            nonlocal left
            if left == 0:
                raise Killed
            left -= 1
            return call(*arguments, **more)

        return step

    with pytest.raises(Killed), replacing_set(paths) as temporaries:
        for temporary in temporaries:
            temporary.write_text("new")
        monkeypatch.setattr(files.os, "replace", dies(os.replace))
        monkeypatch.setattr(files.Path, "unlink", dies(files.Path.unlink))
    monkeypatch.undo()
    assert len({path.read_text() for path in paths if path.exists()}) == 1


def left_by_a_killed_process(*places):
    """What a process leaves at each place that is killed while it writes there."""
    code = (
        "import os, sys\nfrom papilla.core.files import replacing\n"
        "contexts = [replacing(place) for place in sys.argv[1:]]\n"
        "for context in contexts: context.__enter__().write_text('half')\n"
        "os._exit(9)\n"
    )
    subprocess.run([sys.executable, "-c", code, *map(str, places)], check=False)


def test_what_a_killed_process_left_goes_with_the_next_write(tmp_path):
    left_by_a_killed_process(tmp_path / "note.txt", tmp_path / "other.txt")
    assert len(list(tmp_path.iterdir())) == 2
    write_text(tmp_path / "new.txt", "text")
    assert [path.name for path in tmp_path.iterdir()] == ["new.txt"]


def test_what_others_are_writing_stays(tmp_path):
    alive, foreign = f"papilla-{files._HOST}-{os.getppid()}-0123abcd.tmp", "papilla-00000000-1-0123abcd.tmp"
    names = {f".a.{alive}", f".a.{foreign}", ".a.tmp", "papilla-1-2-3.tmp", f".a.{foreign}.bak"}
    for name in names:
        (tmp_path / name).write_text("")
    with replacing(tmp_path / "b") as own:
        write_text(tmp_path / "c", "text")
        own.write_text("text")
    assert {path.name for path in tmp_path.iterdir()} == names | {"b", "c"}
    day = (tmp_path / f".a.{foreign}").stat().st_mtime - files.OLD_S - 1
    os.utime(tmp_path / f".a.{foreign}", (day, day))
    write_text(tmp_path / "c", "text")
    assert {path.name for path in tmp_path.iterdir()} == (names | {"b", "c"}) - {f".a.{foreign}"}


def test_a_scratch_folder_is_private_and_goes_and_takes_stale_ones_along(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    stale = tmp_path / f".mesh.papilla-{files._HOST}-{ended.pid}-0123abcd.tmp"
    (stale / "deep").mkdir(parents=True)
    (stale / "deep" / "file").write_text("")
    with pytest.raises(RuntimeError), scratch("mesh") as folder:
        assert list(tmp_path.iterdir()) == [folder]
        assert os.name == "nt" or folder.stat().st_mode & 0o777 == 0o700
        (folder / "file").write_text("")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("use", [lambda path: write_text(path, "text"), check_writable])
def test_names_that_no_file_can_have(tmp_path, use):
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    for name in ("nul\0.txt", "loop", "loop/x", "n" * 300):
        with pytest.raises(FileAccessError, match=r"^cannot write [^\0\n]*$"):
            use(tmp_path / name)


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
