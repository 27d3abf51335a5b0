"""Atomic files and tables: the whole new file or the old one, and nothing left beside it."""

import errno
import math
import os
import subprocess
import sys

import numpy as np
import pytest

from papilla.core import files, seams
from papilla.core.errors import FileAccessError
from papilla.core.files import OLD_S, check_writable, replacing, replacing_set, scratch, sidecar, write_text
from papilla.core.outside import toml


def test_it_replaces_the_file_or_keeps_the_old_one_and_leaves_nothing_beside_it(tmp_path):
    target = tmp_path / "note.txt"
    for text in ("one", "two"):
        write_text(target, text)
        assert target.read_text() == text
    with pytest.raises(RuntimeError), replacing(target) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    with pytest.raises(FileAccessError, match=r"cannot write .*note.txt: No space left"), replacing(target):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert target.read_text() == "two" and list(tmp_path.iterdir()) == [target]


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


@pytest.mark.parametrize("error", [None, OSError(errno.ENOSPC, "No space left"), ValueError("no"), KeyboardInterrupt()])
def test_a_set_is_written_whole_or_not_at_all(tmp_path, error):
    paths = [tmp_path / name for name in ("a", "b", "c")]
    for text in ("one", "two"):
        with replacing_set(paths) as temporaries:
            for temporary in temporaries:
                temporary.write_text(text)
            assert all(not path.exists() or path.read_text() == "one" for path in paths)
        assert [path.read_text() for path in paths] == [text] * 3
    if error is not None:
        with pytest.raises((FileAccessError, ValueError, KeyboardInterrupt)), replacing_set(paths) as temporaries:
            temporaries[0].write_text("new")
            raise error
    assert [path.read_text() for path in paths] == ["two"] * 3 and sorted(tmp_path.iterdir()) == paths


@pytest.mark.parametrize("steps", range(4))
@pytest.mark.parametrize(
    "fault", [KeyboardInterrupt(), OSError(errno.ENOSPC, "No space left"), OSError(errno.EIO, "IO")]
)
def test_no_file_of_a_new_set_stands_beside_one_of_the_old(tmp_path, monkeypatch, steps, fault):
    """Whatever exchange of a file the disk fails at or the process is stopped before."""
    paths, moved = [tmp_path / name for name in ("a", "b", "c")], []
    for path in paths:
        path.write_text("old")
    replace = seams.replace

    def fails(source, target):
        if len(moved) == steps:
            raise fault
        moved.append(target)
        replace(source, target)

    monkeypatch.setattr(seams, "replace", fails)
    try:
        with replacing_set(paths) as temporaries:
            for temporary in temporaries:
                temporary.write_text("new")
        assert steps == 3
    except (KeyboardInterrupt, FileAccessError) as error:
        assert steps < 3 and (isinstance(error, KeyboardInterrupt) or str(error).startswith("cannot write "))
    assert len({path.read_text() for path in paths if path.exists()}) == 1
    assert {*tmp_path.iterdir()} <= {*paths}


def left_by_a_killed_process(*places):
    """What a process leaves at each place that is killed while it writes there."""
    code = (
        "import os, sys\nfrom papilla.core.files import replacing, scratch\n"
        "contexts = [replacing(place) for place in sys.argv[1:]]\n"
        "for context in contexts: context.__enter__().write_text('half')\n"
        "kept = scratch('mesh'); folder = kept.__enter__()\n"
        "(folder / 'deep').mkdir(); (folder / 'deep' / 'file').write_text('half')\n"
        "os._exit(9)\n"
    )
    subprocess.run([sys.executable, "-c", code, *map(str, places)], check=False)


def test_what_a_killed_process_left_goes_with_the_next_write(tmp_path, monkeypatch):
    (tmp_path / "scratch").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "scratch"))
    left_by_a_killed_process(tmp_path / "note.txt", tmp_path / "other.txt")
    assert len(list(tmp_path.iterdir())) == 3 and len(list((tmp_path / "scratch").iterdir())) == 1
    write_text(tmp_path / "new.txt", "text")
    write_text(tmp_path / "scratch" / "new.txt", "text")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["new.txt", "scratch"]
    assert [path.name for path in (tmp_path / "scratch").iterdir()] == ["new.txt"]


def test_what_others_are_writing_stays_and_goes_after_a_day(tmp_path):
    with replacing(tmp_path / "a") as mine:
        name = mine.name
        mine.touch()
    alive, foreign = name.replace(f"-{os.getpid()}-", f"-{os.getppid()}-"), ".a.papilla-00000000-1-0123abcd.tmp"
    (tmp_path / "a").unlink()
    names = {alive, foreign, ".a.tmp", "papilla-1-2-3.tmp", f"{foreign}.bak"}
    assert alive != name
    for name in names:
        (tmp_path / name).write_text("")
    with replacing(tmp_path / "b") as own:
        write_text(tmp_path / "c", "text")
        own.write_text("text")
    assert {path.name for path in tmp_path.iterdir()} == names | {"b", "c"}
    day = (tmp_path / foreign).stat().st_mtime - OLD_S - 1
    os.utime(tmp_path / foreign, (day, day))
    write_text(tmp_path / "c", "text")
    assert {path.name for path in tmp_path.iterdir()} == (names | {"b", "c"}) - {foreign}


def test_a_scratch_folder_is_private_and_goes():
    with pytest.raises(RuntimeError), scratch("mesh") as folder:
        assert os.name == "nt" or folder.stat().st_mode & 0o777 == 0o700
        (folder / "file").write_text("")
        raise RuntimeError
    assert not folder.exists()


@pytest.mark.parametrize("use", [lambda path: write_text(path, "text"), check_writable])
def test_names_that_no_file_can_have(tmp_path, use):
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    for name in ("nul\0.txt", "loop", "loop/x", "n" * 300):
        with pytest.raises(FileAccessError, match=r"^cannot write [^\0\n]*$"):
            use(tmp_path / name)


def test_it_refuses_where_no_file_can_be_and_makes_no_more_than_a_folder(tmp_path):
    (tmp_path / "folder").mkdir()
    for name in ("missing/note.txt", "folder"):
        with pytest.raises(FileAccessError, match="cannot write"):
            write_text(tmp_path / name, "text")
    check_writable(tmp_path / "a" / "b")
    assert list((tmp_path / "a" / "b").iterdir()) == []
    (tmp_path / "file").write_text("")
    with pytest.raises(FileAccessError, match="cannot write to folder .*file/out: Not a directory"):
        check_writable(tmp_path / "file" / "out")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    write_text(tmp_path / "link", "text")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "real").read_text() == "text"
    names = [sidecar(name, "truth.json").name for name in ("a.csv", "a.dat", "a.b.csv")]
    assert names == ["a.truth.json", "a.dat.truth.json", "a.b.truth.json"]


def drawn_value(rng, depth):
    """A value of a TOML table: numbers, truth, text of any letters, lists and tables."""
    choice = rng.integers(0, 7 if depth else 5)
    if choice == 4:
        return "".join(map(chr, rng.choice([34, 92, 9, 10, 0x7F, 0x85, 0x202E, 0xE9, 0xFFFF, 0x10000, 0xE0001], 6)))
    if choice == 5:
        return [drawn_value(rng, depth - 1) for _ in range(rng.integers(0, 4))]
    if choice == 6:
        return {f"k{k}": drawn_value(rng, depth - 1) for k in range(rng.integers(1, 4))}
    return [
        float(rng.normal() * 10.0 ** rng.integers(-300, 300)),
        int(rng.integers(-9, 9)),
        bool(choice > 2),
        math.inf,
    ][rng.integers(4)]


@pytest.mark.parametrize("seed", range(12))
def test_what_is_written_as_toml_is_read_back(seed):
    rng = np.random.default_rng(seed)
    content = {f"x{k}": drawn_value(rng, 3) for k in range(8)}
    assert toml("\n".join(files.toml_lines(content)), "t.toml") == content


def test_lists_of_lists_have_a_line_each():
    assert files.toml_value([(1, 2), (3.5, 4)]).count("\n") == 3 and files.toml_value([(1, 2), 3]).count("\n") == 3
    assert files.toml_value([1, "a", 3]) == '[1, "a", 3]' and files.toml_value((1.5, 2)) == "[1.5, 2]"
    assert files.toml_value("a\u202eb") == '"a\\u202eb"'
