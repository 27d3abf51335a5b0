"""What numba keeps is loaded from the user's own folder alone, and only as it was written."""

import os
import pickle
from pathlib import Path

import numpy as np
import pytest

from papilla.estimators.tracking import compiled
from papilla.files import private

numba = pytest.importorskip("numba")


def doubled(value):
    return 2.0 * value


def sum_of_doubles(values):
    total = 0.0
    for value in values:
        total += doubled(value)
    return total


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The folder of what is compiled of the functions above."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "cache"))
    yield compiled.kernel_cache((doubled, sum_of_doubles))
    compiled._compiled.cache_clear()


def run():
    """Compile or load in a fresh namespace and use it; how often it was loaded."""
    compiled._compiled.cache_clear()
    entry = compiled.kernels((doubled, sum_of_doubles), True).sum_of_doubles
    assert entry(np.arange(4.0)) == 12.0
    return sum(entry.stats.cache_hits.values())


def test_what_was_compiled_is_loaded_the_next_time(folder):
    assert run() == 0 and run() == 1
    assert {file.suffix for file in folder.rglob("*") if file.is_file()} == {".nbi", ".nbc", ".sha256"}


class Hostile:
    """Runs a command when it is unpickled."""

    def __init__(self, place):
        self.place = place

    def __reduce__(self):
        return (open, (str(self.place), "w"))


def damage(path: Path, how: str, place: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    hostile = pickle.dumps(Hostile(place))
    path.write_bytes({"flip": bytes(content), "truncate": bytes(content[:40]), "empty": b"", "hostile": hostile}[how])


@pytest.mark.parametrize("how", ["flip", "truncate", "empty", "hostile"])
@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
def test_damage_is_noticed_before_anything_is_loaded(folder, tmp_path, suffix, how):
    run()
    damage(next(folder.rglob(f"*{suffix}")), how, tmp_path / "ran")
    with pytest.warns(RuntimeWarning, match="compiled code in .* is damaged: compiling again"):
        assert run() == 0
    assert not (tmp_path / "ran").exists()
    assert run() == 1


@pytest.mark.parametrize("seal", ["", None, "0" * 64])
def test_without_its_seal_nothing_is_loaded(folder, seal):
    run()
    (folder / compiled.SEAL).unlink()
    if seal is not None:
        (folder / compiled.SEAL).write_text(seal)
    with pytest.warns(RuntimeWarning, match="compiling again"):
        assert run() == 0


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="owners and modes of POSIX")
def test_a_folder_that_others_write_is_not_used(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(compiled, "user_cache_dir", lambda *_, **__: str(tmp_path / "own"))
    assert compiled.kernel_cache((doubled,)).is_relative_to(tmp_path / "cache")
    (tmp_path / "cache").mkdir(mode=0o700)
    (tmp_path / "cache").chmod(0o777)
    assert compiled.kernel_cache((doubled,)).is_relative_to(tmp_path / "own")
    (tmp_path / "cache").chmod(0o700)
    if os.getuid() == 0:
        os.chown(tmp_path / "cache", 12345, -1)
    else:
        monkeypatch.setattr(os, "getuid", lambda: 12345)
    assert compiled.kernel_cache((doubled,)).is_relative_to(tmp_path / "own")


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="owners and modes of POSIX")
@pytest.mark.parametrize(
    "mode, parent, expected",
    [(0o700, 0o700, True), (0o755, 0o755, True), (0o770, 0o700, False), (0o702, 0o700, False), (0o700, 0o1777, True)]
    + [(0o700, 0o777, False), (0o700, 0o775, True), (0o1777, 0o700, False)],
)
def test_private_is_what_this_user_alone_writes(tmp_path, mode, parent, expected):
    place = tmp_path / "parent" / "folder"
    place.mkdir(parents=True)
    place.chmod(mode)
    place.parent.chmod(parent)
    assert private(place) is expected
    place.parent.chmod(0o700)


def test_a_folder_that_cannot_be_made_is_said_and_done_without(tmp_path, monkeypatch, folder):
    (tmp_path / "cache").write_text("in the way")
    with pytest.warns(RuntimeWarning, match="compiled code cannot be kept in .* \\(Not a directory\\)"):
        assert run() == 0
