"""The cache: kept, locked, checked, rebuilt; unusable folders are one clear line."""

import errno
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock

from papilla import cache
from papilla.errors import FileAccessError
from papilla.mesh import builder as builder_module
from papilla.mesh.builder import build
from papilla.mesh.packing import pack


class Maker:
    """Counts how often it was asked."""

    def __init__(self, value=1.0):
        self.calls = 0
        self.value = value

    def __call__(self):
        self.calls += 1
        return {"field": np.full((3, 2), self.value), "name": np.array("skin")}


def test_entry_is_made_once_and_kept_to_the_bit():
    make = Maker(np.pi)
    first = cache.fetch("thing", "a", make)
    second = cache.fetch("thing", "a", make)
    assert make.calls == 1
    assert second["field"].tobytes() == first["field"].tobytes() and str(second["name"]) == "skin"


def test_keys_and_kinds_are_apart():
    make = Maker()
    for kind, key in (("thing", "a"), ("thing", "b"), ("other", "a")):
        cache.fetch(kind, key, make)
    assert make.calls == 3


def test_digest_tells_values_apart():
    keys = {cache.digest(*parts) for parts in ((1, 2.0), (2, 1.0), ("1", 2.0), (1, 2.0 + 1e-15), ((1, 2.0),), ())}
    assert len(keys) == 6
    assert cache.digest(0.7, "abc") == cache.digest(0.7, "abc")


@pytest.mark.parametrize("damage", ["flip", "truncate", "empty", "garbage"])
def test_damaged_entry_is_noticed_and_made_again(damage):
    make = Maker()
    good = cache.fetch("thing", "a", make)
    path = cache.entry("thing", "a")
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    broken = {"flip": bytes(content), "truncate": content[:100], "empty": b"", "garbage": b"not a cache entry\n" * 9}
    path.write_bytes(broken[damage])
    with pytest.warns(RuntimeWarning, match="damaged"):
        again = cache.fetch("thing", "a", make)
    assert make.calls == 2
    assert again["field"].tobytes() == good["field"].tobytes()
    cache.fetch("thing", "a", make)
    assert make.calls == 2


def test_failed_make_leaves_nothing():
    def fail():
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        cache.fetch("thing", "a", fail)
    make = Maker()
    cache.fetch("thing", "a", make)
    assert make.calls == 1


def test_objects_are_refused():
    with pytest.raises(ValueError, match="[Oo]bject arrays"):
        cache.fetch("thing", "a", lambda: {"x": np.array([{}], dtype=object)})
    assert not cache.entry("thing", "a").exists()


def test_two_callers_make_once():
    make, started = Maker(), threading.Barrier(2)

    def slow():
        time.sleep(0.2)
        return make()

    def work():
        started.wait()
        cache.fetch("thing", "a", slow)

    threads = [threading.Thread(target=work) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert make.calls == 1


def test_waits_for_the_lock_of_another():
    path = cache.entry("thing", "a")
    path.parent.mkdir(parents=True)
    lock = FileLock(f"{path}.lock")
    make = Maker()
    with lock:
        waiting = threading.Thread(target=cache.fetch, args=("thing", "a", make))
        waiting.start()
        waiting.join(0.3)
        assert waiting.is_alive() and make.calls == 0
    waiting.join()
    assert make.calls == 1


def test_folder_that_cannot_be_is_refused_before_work(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "file"))
    make = Maker()
    with pytest.raises(FileAccessError, match="cannot use the cache folder .*PAPILLA_CACHE"):
        cache.fetch("thing", "a", make)
    assert make.calls == 0


def test_full_disk_is_one_clear_line(monkeypatch):
    def full(self, data):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(FileAccessError, match="No space left on device") as caught:
        cache.fetch("thing", "a", Maker())
    assert "\n" not in str(caught.value)
    assert sorted(path.suffix for path in cache.folder().rglob("*.*")) in ([], [".lock"])


def test_default_folder_is_the_users(monkeypatch):
    monkeypatch.delenv("PAPILLA_CACHE")
    assert "papilla" in cache.folder().name


def test_build_meshes_once_and_again_for_what_changes_the_mesh(dome, dome_shape, finger_of, monkeypatch):
    asked = []

    def mesher(finger, size_mm, *, variant, progress):
        asked.append((finger.shape, size_mm, variant))
        return dome

    monkeypatch.setattr(builder_module, "mesh_finger", mesher)
    finger = finger_of(dome_shape)
    assert build(finger, 2.5).sha256 == build(finger, 2.5).sha256 == dome.sha256
    assert len(asked) == 1
    build(finger, 2.4)
    build(finger, 2.5, variant=1)
    assert len(asked) == 3
    build(finger, 2.5, cache=False)
    assert len(asked) == 4


def test_packed_mesh_is_a_quarter(dome):
    assert len(pack(dome)["tets"]) * 4 == len(dome.tets)
