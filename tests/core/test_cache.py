"""The cache: keyed by code and values, kept, locked, checked, rebuilt; done without where it cannot be used."""

import errno
import hashlib
import hmac
import inspect
import os
import shutil
import stat
import subprocess
import sys
import threading
import warnings
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock

import papilla
from papilla import calibration as calibrate
from papilla import fem, mesh, references
from papilla.calibration import Calibration
from papilla.core import cache
from papilla.core.errors import InputError
from papilla.fem.preparing import REDUCED_BY
from papilla.fem.pressing import prices
from papilla.mesh import builder
from papilla.mesh.builder import VARIANTS
from papilla.mesh.surfaces import Ellipsoid, TriangleSurface
from papilla.mesh.worker import read_surface
from papilla.model.finger import Finger
from papilla.model.specimen import Block, Sphere
from papilla.view import pictures
from papilla.view.strain_field import strain_figure

ROOT = Path(papilla.__file__).parents[1]
NO_OWNERS = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="files have no owners and rights here")


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(cache, "_warned", set())


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


def test_a_key_tells_values_apart():
    long = np.arange(5000.0)
    other = long.copy()
    other[2500] += 1e-9
    values = [(), (1, 2.0), (2, 1.0), ("1", 2.0), (1, 2.0 + 1e-15), ((1, 2.0),), (None,), (True,), (b"1",), (long,)]
    values += [(other,), (long.astype(np.float32),), (long.reshape(50, 100),), ({"a": 1},), ({"b": 1},)]
    values += [(Block(0.5, 10.0),), (Block(0.5, 10.1),), (Sphere(0.5, 10.0),), (Block(0.5, 10.0), 1)]
    keys = [cache.key("papilla.core.files", *parts) for parts in values]
    assert len(set(keys)) == len(values)
    assert keys == [cache.key("papilla.core.files", *parts) for parts in values]
    assert cache.key("papilla.core.files", np.float64(0.7)) == cache.key("papilla.core.files", 0.7)


def test_what_has_no_content_of_its_own_is_no_part_of_a_key():
    with pytest.raises(InputError, match="cannot depend on a function"):
        cache.key("papilla.core.files", lambda: 1)
    with pytest.raises(InputError, match=r"papilla\.nothing is no module of papilla"):
        cache.key("papilla.nothing", 1)


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    folder = tmp_path_factory.mktemp("copy")
    for package in ("papilla", "papilla_papers"):
        shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("data", "__pycache__"))
    return folder


@pytest.fixture
def edit(sources, monkeypatch):
    """`edit(file, old, new)` changes the file in a copy of the sources that keys are made of, and forgets what was
    read; without `old` a constant is added."""
    monkeypatch.setattr(cache, "_ROOT", sources)
    changed = {}

    def forget():
        for known in (cache._code, cache._sources):
            known.cache_clear()

    def change(name, old=None, new="EDITED = 1\n"):
        text = (sources / name).read_text()
        changed.setdefault(name, text)
        assert old is None or text.count(old) == 1
        (sources / name).write_text(text + new if old is None else text.replace(old, new))
        forget()

    forget()
    yield change
    for name, text in changed.items():
        (sources / name).write_text(text)
    monkeypatch.undo()
    forget()


SWEEP, REDUCED, READER = calibrate.sweep.__module__, REDUCED_BY, read_surface.__module__
PICTURE, PRICES, POSITIONS = pictures.__name__, prices.MEASURED_BY, calibrate.with_positions.__module__
BELOW = {
    SWEEP: (calibrate.sweep, Block, references.bonded_layer_deficit, fem.press, fem.ReducedFinger),
    REDUCED: (fem.FingerModel, Finger, Ellipsoid, TriangleSurface, mesh.LayeredMesh, read_surface),
    READER: (read_surface,),
    PICTURE: (strain_figure, fem.recover, fem.ReceptiveFields, mesh.LayeredMesh),
    PRICES: (fem.press, fem.press_finite, fem.FingerModel, Block),
    POSITIONS: (fem.FingerModel, Calibration, Block, fem.press),
}


@pytest.mark.parametrize("maker, thing", [(maker, thing) for maker, things in BELOW.items() for thing in things])
def test_a_key_changes_with_all_the_code_that_the_result_runs_through(maker, thing, edit):
    before = cache.key(maker, 1)
    assert cache.key(maker, 1) == before
    edit(Path(inspect.getfile(thing)).relative_to(ROOT))
    assert cache.key(maker, 1) != before


@pytest.mark.parametrize(
    "name", ["papilla/estimators/__init__.py", "papilla/cli/main.py", "papilla_papers/claims/runner.py"]
)
@pytest.mark.parametrize("maker", [SWEEP, REDUCED, READER])
def test_code_that_no_kept_result_runs_through_leaves_its_key(maker, name, edit):
    before = cache.key(maker, 1)
    edit(name)
    assert cache.key(maker, 1) == before


WORDS = {
    "comment": ("# Flat faces are searched", "# Flat faces are sought"),
    "docstring of a module": ('"""A new mesh from the mesher', '"""A fresh mesh from the mesher'),
    "docstring of a function": ('"""A new mesh of a finger;', '"""A fresh mesh of a finger;'),
    "docstring of a constant": ('"""How far the mesher may', '"""How far a mesher may'),
    "formatting": ("REACH = 3.0", "REACH = (\n    3.0\n)"),
}


@pytest.mark.parametrize("old, new", WORDS.values(), ids=WORDS)
def test_words_and_formatting_move_no_key(old, new, edit):
    before = [cache.key(maker, 1) for maker in BELOW]
    edit("papilla/mesh/drawing.py", old, new)
    assert [cache.key(maker, 1) for maker in BELOW] == before


def test_a_constant_moves_the_keys_of_all_that_may_use_it_and_of_nothing_else(edit):
    before = {maker: cache.key(maker, 1) for maker in BELOW}
    edit("papilla/mesh/drawing.py", "REACH = 3.0", "REACH = 3.1")
    assert {maker for maker in BELOW if cache.key(maker, 1) != before[maker]} == {*BELOW} - {READER}


def test_names_that_a_package_imports_on_first_use_count_too(edit):
    edit("papilla/calibration/fitting/checking.py", None, "from papilla.view import strain\n")
    before = cache.key("papilla.calibration.fitting.checking", 1)
    edit("papilla/view/strain_field.py")
    assert cache.key("papilla.calibration.fitting.checking", 1) != before


def test_a_key_changes_with_the_versions_of_what_it_is_computed_with(monkeypatch):
    def keys(upgraded):
        monkeypatch.setattr(cache, "_version", lambda name: "9.9" if name == upgraded else version(name))
        cache._code.cache_clear()
        return {maker: cache.key(maker) for maker in (READER, REDUCED, PICTURE)}

    before = keys(None)
    moved = {name: [maker for maker, key in keys(name).items() if key != before[maker]] for name in UPGRADED}
    assert moved == UPGRADED
    cache._code.cache_clear()


UPGRADED = {
    "numpy": [READER, REDUCED, PICTURE],
    "rslab": [REDUCED, PICTURE],
    "vtk": [READER, REDUCED, PICTURE],
    "matplotlib": [PICTURE],
    "pytetwild": [],
    "typer": [],
}
"""Makers whose results depend on a package."""


def test_layers_above_a_result_leave_its_key(edit):
    before = cache.key(READER, 1), cache.key(REDUCED, 1)
    edit("papilla/calibration/fitting/page.py")
    edit("papilla/view/style.py")
    assert (cache.key(READER, 1), cache.key(REDUCED, 1)) == before


def test_the_meaning_of_the_code_is_read_once_for_all_processes(monkeypatch):
    cache._code.cache_clear()
    before = cache.key(REDUCED, 1)
    cache._code.cache_clear()  # As another process
    monkeypatch.setattr(cache, "_meaning", None)
    assert cache.key(REDUCED, 1) == before


def test_a_stored_mesh_outlives_all_code_and_packages_but_not_the_version_of_the_mesher(monkeypatch):
    made = []

    def drawn(finger, size_mm, **_):
        made.append(size_mm)
        return replace(shipped, size_mm=size_mm)

    shipped = mesh.build(Finger.default())
    monkeypatch.setattr(builder, "drawn", drawn)
    monkeypatch.setattr(cache, "_code", None)
    own = partial(mesh.build, Finger.default(), variant=VARIANTS)  # No mesh of this number ships: it is drawn
    for _ in range(2):
        assert own(0.9).sha256 == replace(shipped, size_mm=0.9).sha256
    assert made == [0.9]
    own(0.9, variant=VARIANTS + 1)
    own(0.8)
    assert made == [0.9, 0.9, 0.8]
    monkeypatch.setattr(builder, "MESHER_VERSION", builder.MESHER_VERSION + 1)
    own(0.9)
    assert made == [0.9, 0.9, 0.8, 0.9]


@pytest.mark.parametrize("damage", ["flip", "truncate", "empty", "garbage", "other key", "other kind"])
def test_damaged_entry_is_noticed_and_made_again(damage):
    make = Maker()
    good = cache.fetch("thing", "a", make)
    path = cache.entry("thing", "a")
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    broken = {"flip": bytes(content), "truncate": content[:100], "empty": b"", "garbage": b"not a cache entry\n" * 9}
    for name, kind, key in (("other key", "thing", "b"), ("other kind", "other", "a")):
        cache.fetch(kind, key, Maker(2.0))
        broken[name] = cache.entry(kind, key).read_bytes()
    path.write_bytes(broken[damage])
    with pytest.warns(RuntimeWarning, match="damaged"):
        again = cache.fetch("thing", "a", make)
    assert make.calls == 2
    assert again["field"].tobytes() == good["field"].tobytes()
    cache.fetch("thing", "a", make)
    assert make.calls == 2


def resealed(path, entry="thing a"):
    """Seal what is in an entry again, as anybody can without the user's secret."""
    body = path.read_bytes().partition(b"\n")[2]
    line = f"{entry}\n".encode() + body
    for seal in (hashlib.sha256(line), hmac.new(bytes(32), line, "sha256"), hmac.new(b"", line, "sha256")):
        for name in ("", path.read_bytes()[:17].decode(), "0" * 16 + " "):
            yield name.encode() + seal.hexdigest().encode() + b"\n" + body


@pytest.mark.parametrize("guess", range(9))
def test_an_entry_that_was_edited_and_sealed_again_never_answers(guess):
    cache.keep("thing", "a", Maker(666.0)())
    path = cache.entry("thing", "a")
    path.write_bytes([*resealed(path)][guess])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert cache.find("thing", "a", report=True) is None
        assert cache.fetch("thing", "a", Maker(1.0))["field"][0, 0] == 1.0
    assert cache.find("thing", "a")["field"][0, 0] == 1.0, "the entry was replaced"


def test_a_folder_that_somebody_else_made_never_answers(tmp_path, monkeypatch):
    """Its entries are computed again without a word, and replaced."""
    mine = os.environ["XDG_DATA_HOME"]
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "theirs"))
    cache.keep("thing", "a", Maker(666.0)())
    monkeypatch.setenv("XDG_DATA_HOME", mine)
    assert cache.find("thing", "a", report=True) is None
    assert cache.fetch("thing", "a", Maker())["field"][0, 0] == 1.0
    assert cache.find("thing", "a")["field"][0, 0] == 1.0


def test_an_entry_of_an_older_papilla_is_computed_again_without_a_word():
    cache.keep("thing", "a", Maker(666.0)())
    path = cache.entry("thing", "a")
    path.write_bytes(next(resealed(path)))  # Its seal had no key
    assert cache.fetch("thing", "a", Maker())["field"][0, 0] == 1.0


MAKES_A_SECRET = "from papilla import cache; cache.keep('thing', '{}', {{'n': __import__('numpy').ones(1)}})"


@pytest.mark.slow
def test_processes_that_start_together_make_one_secret(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "new"))
    started = [subprocess.Popen([sys.executable, "-c", MAKES_A_SECRET.format(key)]) for key in "abcdef"]
    assert [process.wait() for process in started] == [0] * 6
    assert all(cache.find("thing", key) is not None for key in "abcdef")
    assert len(cache.secret_file().read_bytes()) == 32


@NO_OWNERS
def test_the_secret_is_the_users_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    assert cache.usable()
    path = cache.secret_file()
    assert tmp_path / "data" in path.parents and path.stat().st_mode & 0o077 == 0
    assert path.parent.stat().st_mode & 0o077 == 0
    assert cache.folder() not in path.parents, "a copied cache folder brings no secret"


@pytest.fixture
def no_secret(tmp_path, monkeypatch, request):
    """A data folder in which there is no secret that can be used."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    path = cache.secret_file()
    path.parent.mkdir(parents=True)
    if request.param == "folder":
        path.parent.rmdir()
        path.parent.write_text("in the way")
    elif request.param == "readable":
        path.write_bytes(bytes(32))
        path.chmod(0o644)
    else:
        path.touch(0o600)
        path.write_bytes({"short": bytes(31), "long": bytes(33), "empty": b""}[request.param])


@NO_OWNERS
@pytest.mark.parametrize("no_secret", ["folder", "readable", "short", "long", "empty"], indirect=True)
def test_without_a_secret_the_cache_is_done_without_and_said_once(no_secret):
    make = Maker()
    with pytest.warns(RuntimeWarning, match=r"no secret to seal its entries.*going on without it") as said:
        for _ in range(3):
            assert cache.fetch("thing", "a", make)["field"][0, 0] == 1.0
    assert make.calls == 3 and len(said) == 1 and "\n" not in str(said[0].message)
    assert not cache.usable()
    assert not cache.entries()


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
    make, inside, release = Maker(), threading.Event(), threading.Event()

    def slow():
        inside.set()
        release.wait()
        return make()

    first = threading.Thread(target=cache.fetch, args=("thing", "a", slow))
    second = threading.Thread(target=cache.fetch, args=("thing", "a", make))
    first.start()
    inside.wait()
    second.start()
    release.set()
    first.join()
    second.join()
    assert make.calls == 1


def held(path) -> FileLock:
    """The lock of an entry, as another process would hold it."""
    cache._make_folders(path)
    lock = FileLock(f"{path}.lock")
    lock.acquire()
    return lock


def test_says_that_it_waits_for_another_and_takes_what_that_made(monkeypatch):
    monkeypatch.setattr(cache, "PATIENCE_S", 0.01)
    lock, make, said = held(cache.entry("thing", "a")), Maker(), []

    def other_process(message, *_, **__):
        said.append(str(message))
        cache.keep("thing", "a", Maker(5.0)())
        lock.release()

    monkeypatch.setattr(cache.warnings, "warn", other_process)
    found = cache.fetch("thing", "a", make)
    assert make.calls == 0 and found["field"][0, 0] == 5.0
    assert len(said) == 1 and said[0].startswith("waiting for another process that makes ")


def test_goes_on_alone_where_another_never_lets_go(monkeypatch):
    monkeypatch.setattr(cache, "PATIENCE_S", 0.01)
    monkeypatch.setattr(cache, "GIVE_UP_S", 0.01)
    lock = held(cache.entry("thing", "a"))
    with pytest.warns(RuntimeWarning) as said:
        assert cache.fetch("thing", "a", Maker(3.0))["field"][0, 0] == 3.0
    assert ["waiting for" in str(said[0].message), "going on without it" in str(said[1].message)] == [True, True]
    lock.release()


def test_a_folder_that_cannot_be_is_done_without_and_said_once(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "file"))
    make = Maker()
    with pytest.warns(RuntimeWarning, match="cannot use the cache folder .*PAPILLA_CACHE") as said:
        for _ in range(3):
            assert cache.fetch("thing", "a", make)["field"][0, 0] == 1.0
    assert make.calls == 3 and len(said) == 1 and "\n" not in str(said[0].message)


def plant(value):
    """The entry of another value, sealed as papilla seals it."""
    cache.fetch("thing", "a", Maker())
    cache.keep("thing", "a", Maker(value)())


@NO_OWNERS
@pytest.mark.parametrize("bits", [0o020, 0o002], ids=["group", "others"])
@pytest.mark.parametrize("place", ["folder", "kind", "entry"])
def test_what_others_can_write_to_is_not_used_and_said_once(place, bits):
    plant(666.0)
    where = {"folder": cache.folder(), "kind": cache.folder() / "thing", "entry": cache.entry("thing", "a")}[place]
    where.chmod(where.stat().st_mode | bits)
    kept = cache.entry("thing", "a").read_bytes()
    with pytest.warns(RuntimeWarning, match=f"others can write to {where}.*PAPILLA_CACHE") as said:
        for _ in range(2):
            assert cache.fetch("thing", "a", Maker())["field"][0, 0] == 1.0
            assert cache.find("thing", "a", report=True) is None
    assert len(said) == 1 and "\n" not in str(said[0].message)
    assert cache.entry("thing", "a").read_bytes() == kept


@NO_OWNERS
def test_what_belongs_to_another_user_is_not_used(monkeypatch):
    plant(666.0)
    owner = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: owner + 1)
    with pytest.warns(RuntimeWarning, match="belongs to another user"):
        assert cache.fetch("thing", "a", Maker())["field"][0, 0] == 1.0


@NO_OWNERS
@pytest.mark.parametrize("place", ["folder", "kind", "entry"])
def test_a_link_of_another_user_is_not_followed(place, tmp_path, monkeypatch):
    plant(666.0)
    where = {"folder": cache.folder(), "kind": cache.folder() / "thing", "entry": cache.entry("thing", "a")}[place]
    where.rename(tmp_path / "elsewhere")
    where.symlink_to(tmp_path / "elsewhere")
    assert cache.fetch("thing", "a", Maker())["field"][0, 0] == 666.0  # The user's own link to what is the user's own
    lstat = Path.lstat

    def of_another(path):
        found = lstat(path)
        return os.stat_result((*found[:4], found.st_uid + (path == where), *found[5:10]))

    monkeypatch.setattr(Path, "lstat", of_another)
    with pytest.warns(RuntimeWarning, match=f"{where} belongs to another user"):
        assert cache.fetch("thing", "a", Maker())["field"][0, 0] == 1.0


@NO_OWNERS
def test_the_entry_that_was_opened_is_the_one_that_is_checked(tmp_path, monkeypatch):
    """Between the look at a name and its opening, another file may have been put there."""
    plant(666.0)
    check, swapped = cache._check_own, cache.entry("thing", "a")

    def then_swap(path):
        check(path)
        swapped.chmod(0o666)

    monkeypatch.setattr(cache, "_check_own", then_swap)
    with pytest.warns(RuntimeWarning, match="others can write"):
        assert cache.find("thing", "a") is None


@NO_OWNERS
@pytest.mark.parametrize("umask", [0o000, 0o002, 0o077])
def test_folders_and_files_are_made_for_the_user_alone(umask):
    before = os.umask(umask)
    try:
        cache.fetch("thing", "a", Maker())
    finally:
        os.umask(before)
    modes = {path.name: stat.S_IMODE(path.stat().st_mode) for path in [cache.folder(), *cache.folder().rglob("*")]}
    assert modes == {"cache": 0o700, "thing": 0o700, "a.entry": 0o600, "a.entry.lock": 0o600}


@NO_OWNERS
def test_a_folder_below_one_that_all_can_write_to_is_used(tmp_path, monkeypatch):
    """As below /tmp: who can write there can take the cache away, but make no file that belongs to the user."""
    (tmp_path / "shared").mkdir()
    (tmp_path / "shared").chmod(0o1777)
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "shared" / "cache"))
    cache.fetch("thing", "a", Maker(2.0))
    assert cache.fetch("thing", "a", Maker())["field"][0, 0] == 2.0


def test_where_files_have_no_owners_nothing_is_checked(monkeypatch):
    cache.fetch("thing", "a", Maker(2.0))
    cache.entry("thing", "a").chmod(0o666)
    monkeypatch.delattr(os, "geteuid", raising=False)
    assert cache.fetch("thing", "a", Maker())["field"][0, 0] == 2.0


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root writes everywhere")
def test_a_read_only_cache_is_read_and_done_without(tmp_path):
    kept = Maker(2.0)
    cache.fetch("thing", "a", kept)
    for place in (cache.folder() / "thing", cache.folder()):
        place.chmod(0o500)
    assert cache.fetch("thing", "a", Maker())["field"][0, 0] == 2.0
    with pytest.warns(RuntimeWarning, match="Permission denied"):
        assert cache.fetch("thing", "b", Maker(4.0))["field"][0, 0] == 4.0
    for place in (cache.folder(), cache.folder() / "thing"):
        place.chmod(0o700)


def test_a_full_disk_does_not_refuse_what_was_computed(monkeypatch):
    def full(self, data):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.warns(RuntimeWarning, match="No space left on device"):
        assert cache.fetch("thing", "a", Maker())["field"].shape == (3, 2)
    assert sorted(path.suffix for path in cache.folder().rglob("*.*")) in ([], [".lock"])


def test_default_folder_is_the_users(monkeypatch):
    monkeypatch.delenv("PAPILLA_CACHE")
    assert "papilla" in cache.folder().name
