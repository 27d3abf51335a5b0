"""The cache: keyed by code and values, kept, locked, checked, rebuilt; done without where it cannot be used."""

import errno
import hashlib
import hmac
import json
import os
import shutil
import stat
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock

import papilla
from papilla import calibration
from papilla.core import cache, outside, seams
from papilla.core.errors import FileAccessError, InputError, NotOwnError
from papilla.fem.preparing import REDUCED_BY
from papilla.fem.pressing import prices
from papilla.mesh.worker import read_surface
from papilla.model.specimen import Block, Sphere
from papilla.view import pictures

ROOT = Path(papilla.__file__).parents[1]
NO_OWNERS = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="files have no owners and rights here")


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "cache"))


class Maker:
    """Counts how often it was asked."""

    def __init__(self, value=1.0):
        self.calls, self.value = 0, value

    def __call__(self):
        self.calls += 1
        return {"field": np.full((3, 2), self.value), "name": np.array("skin")}


def value_of(make=None, key="a", **options):
    """The number in an entry, which is made if it is missing."""
    return cache.fetch("thing", key, make or Maker(), **options)["field"][0, 0]


def test_an_entry_is_made_once_and_kept_to_the_bit():
    make = Maker(np.pi)
    first, second = (cache.fetch("thing", "a", make) for _ in range(2))
    assert make.calls == 1
    assert second["field"].tobytes() == first["field"].tobytes() and str(second["name"]) == "skin"
    for kind, key in (("thing", "b"), ("other", "a")):
        cache.fetch(kind, key, make)
    assert make.calls == 3, "keys and kinds are apart"
    assert len(cache.entries()) == 3 and all(size > 0 for size in cache.entries().values())
    cache.clean()
    assert not cache.entries() and cache.find("thing", "a") is None


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


# ---- keys and code: a copy of the sources is edited, and another process makes its keys

SWEEP, REDUCED, READER = calibration.sweep.__module__, REDUCED_BY, read_surface.__module__
PICTURE, PRICES = pictures.__name__, prices.PRICING_MODULE
MAKERS = (SWEEP, REDUCED, READER, PICTURE, PRICES)
KEYS = """
import json, sys
from papilla.core import cache
keys = {maker: cache.key(maker, 1) for maker in sys.argv[1:]}
print(json.dumps(keys | {"by hand": cache.versioned_key("mesh", 3, 1)}))
"""


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """`moved(edits)` : the makers whose keys change with edits {file: (old, new)} of a copy of the sources."""
    folder = tmp_path_factory.mktemp("copy")
    for package in ("papilla", "papilla_papers"):
        shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("data", "__pycache__"))

    def keys(*places):
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(map(str, (*places, folder))), "PAPILLA_CACHE": str(folder / "cache"),
        }  # fmt: skip
        command = [sys.executable, "-c", KEYS, *MAKERS]
        return json.loads(subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True).stdout)

    before = keys()

    def moved(edits=(), *places):
        texts = {name: (folder / name).read_text() for name in dict(edits)}
        for name, (old, new) in dict(edits).items():
            assert old is None or texts[name].count(old) == 1
            (folder / name).write_text(texts[name] + new if old is None else texts[name].replace(old, new))
        try:
            after = keys(*places)
        finally:
            for name, text in texts.items():
                (folder / name).write_text(text)
        return {maker for maker, key in after.items() if key != before[maker]}

    return moved


ADDED = (None, "EDITED = 1\n")
WORDS = [
    ("# Flat faces are searched", "# Flat faces are sought"),
    ('"""A new mesh from the mesher', '"""A fresh mesh from the mesher'),
    ("REACH_ENVELOPES = 3.0", "REACH_ENVELOPES = (\n    3.0\n)"),
]
"""A comment, docstrings of a module, a function and a constant, and formatting."""


@pytest.mark.slow
@pytest.mark.parametrize("old, new", WORDS)
def test_words_and_formatting_move_no_key(copied, old, new):
    assert copied({"papilla/mesh/drawing.py": (old, new)}) == set()


@pytest.mark.slow
@pytest.mark.parametrize(
    "name, makers",
    [
        ("mesh/drawing.py", {SWEEP, REDUCED, PICTURE, PRICES}), ("model/finger.py", {SWEEP, REDUCED, PICTURE, PRICES}),
        ("mesh/worker.py", {*MAKERS}), ("references/hertz.py", {SWEEP, PRICES}), ("model/specimen.py", {SWEEP, PRICES}),
        ("view/strain_field.py", {PICTURE}),
    ],
)  # fmt: skip
def test_a_key_changes_with_all_the_code_that_the_result_runs_through(copied, name, makers):
    assert copied({f"papilla/{name}": ADDED}) >= makers
    assert "by hand" not in copied({f"papilla/{name}": ADDED}), "a version raised by hand depends on no code"


@pytest.mark.slow
@pytest.mark.parametrize(
    "package, makers",
    [
        ("numpy", {*MAKERS}), ("rslab", {*MAKERS} - {READER}), ("vtk", {*MAKERS}), ("matplotlib", None),
        ("pytetwild", set()), ("typer", set()),
    ],
)  # fmt: skip
def test_a_key_changes_with_the_versions_of_what_it_is_computed_with(copied, tmp_path, package, makers):
    upgraded = tmp_path / f"{package}-99.9.dist-info"
    upgraded.mkdir()
    (upgraded / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 99.9\n")
    moved = copied((), tmp_path)
    assert moved == makers if makers is not None else PICTURE in moved and READER not in moved and REDUCED not in moved


def test_the_meaning_of_the_code_is_kept_too():
    assert len({cache.versioned_key(*by) for by in (("mesh", 1, 2.0), ("mesh", 2, 2.0), ("cell", 1, 2.0))}) == 3
    command = [sys.executable, "-c", KEYS, "papilla.core.files"]
    found = [subprocess.run(command, check=True, capture_output=True).stdout for _ in range(2)]
    assert found[0] == found[1] and [path.parent.name for path in cache.entries()] == ["code"]


# ---- damage, and entries of others


@pytest.mark.parametrize("damage", ["flip", "truncate", "empty", "garbage", "other key", "other kind"])
def test_a_damaged_entry_is_noticed_and_made_again(damage):
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
    assert make.calls == 2 and again["field"].tobytes() == good["field"].tobytes()
    cache.fetch("thing", "a", make)
    assert make.calls == 2


@pytest.mark.parametrize("name", ["none", "the same", "another"])
@pytest.mark.parametrize("seal", ["sha256", "zeros", "nothing"])
def test_an_entry_that_was_edited_and_sealed_again_never_answers(name, seal):
    """As anybody can seal it without the user's secret; the entries of an older papilla had no key."""
    cache.keep("thing", "a", Maker(666.0)())
    path = cache.entry("thing", "a")
    content = path.read_bytes()
    body = content.partition(b"\n")[2]
    line = b"thing a\n" + body
    seals = {"sha256": hashlib.sha256(line), "zeros": hmac.new(bytes(32), line, "sha256")}
    code = seals.get(seal, hmac.new(b"", line, "sha256")).hexdigest().encode()
    path.write_bytes({"none": b"", "the same": content[:17], "another": b"0" * 16 + b" "}[name] + code + b"\n" + body)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert cache.find("thing", "a", report=True) is None
        assert value_of() == 1.0
    assert cache.find("thing", "a")["field"][0, 0] == 1.0, "the entry was replaced"


def test_a_folder_that_somebody_else_made_never_answers(tmp_path, monkeypatch):
    """Its entries are computed again without a word, and replaced."""
    mine = os.environ["XDG_DATA_HOME"]
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "theirs"))
    cache.keep("thing", "a", Maker(666.0)())
    monkeypatch.setenv("XDG_DATA_HOME", mine)
    assert cache.find("thing", "a", report=True) is None
    assert value_of() == 1.0 and cache.find("thing", "a")["field"][0, 0] == 1.0


@NO_OWNERS
@pytest.mark.parametrize("kind", ["folder", "readable", "short", "long", "empty", "file"])
def test_without_a_secret_or_a_folder_the_cache_is_done_without_and_said_once(kind, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    path, why = cache.secret_file(), "no secret to seal its entries"
    path.parent.mkdir(parents=True)
    if kind == "file":
        (tmp_path / "file").write_text("in the way")
        monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "file"))
        why = f"cannot use the cache folder {tmp_path / 'file'} .*PAPILLA_CACHE"
    elif kind == "folder":
        path.parent.rmdir()
        path.parent.write_text("in the way")
    else:
        path.write_bytes(bytes({"short": 31, "long": 33, "empty": 0, "readable": 32}[kind]))
        path.chmod(0o644 if kind == "readable" else 0o600)
    make = Maker()
    with pytest.warns(RuntimeWarning, match=why) as said:
        assert [value_of(make) for _ in range(3)] == [1.0] * 3
    assert make.calls == 3 and len(said) == 1 and "\n" not in (line := str(said[0].message))
    assert "going on without it" in line and not cache.usable() and not cache.entries()


def test_a_failed_make_leaves_nothing():
    def fail():
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        cache.fetch("thing", "a", fail)
    with pytest.raises(ValueError, match="[Oo]bject arrays"):
        cache.fetch("thing", "a", lambda: {"x": np.array([{}], dtype=object)})
    assert not cache.entry("thing", "a").exists() and value_of() == 1.0


# ---- several processes, and folders that cannot be used


@pytest.mark.parametrize("patience", ["600", "0.01"])
def test_two_callers_make_once_and_the_second_says_when_it_waits_long(patience, monkeypatch):
    monkeypatch.setenv("PAPILLA_CACHE_PATIENCE_S", patience)
    make, inside, found, long = Maker(5.0), threading.Event(), [], patience != "600"

    def slow():
        inside.set()
        until = time.monotonic() + 20
        while long and not said and time.monotonic() < until:
            time.sleep(0.01)
        return make()

    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        callers = [threading.Thread(target=lambda make=make: found.append(value_of(make))) for make in (slow, make)]
        callers[0].start()
        inside.wait()
        callers[1].start()
        for caller in callers:
            caller.join()
    assert make.calls == 1 and found == [5.0, 5.0]
    assert [str(one.message)[:38] for one in said] == ["waiting for another process that makes"] * long


def test_it_goes_on_alone_where_another_never_lets_go(monkeypatch):
    monkeypatch.setenv("PAPILLA_CACHE_PATIENCE_S", "0.01")
    value_of(key="b")
    with FileLock(f"{cache.entry('thing', 'a')}.lock"), pytest.warns(RuntimeWarning) as said:
        assert value_of(Maker(3.0), give_up_s=0.01) == 3.0
    assert ["waiting for" in str(said[0].message), "going on without it" in str(said[1].message)] == [True, True]
    monkeypatch.setenv("PAPILLA_CACHE_PATIENCE_S", "long")
    with pytest.raises(InputError, match="PAPILLA_CACHE_PATIENCE_S must be a number of seconds, got 'long'"):
        value_of(key="c")


@NO_OWNERS
@pytest.mark.parametrize("bits", [0o020, 0o002], ids=["group", "others"])
@pytest.mark.parametrize("place", ["folder", "kind", "entry"])
def test_what_others_can_write_to_is_not_used_and_said_once(place, bits):
    cache.keep("thing", "a", Maker(666.0)())
    where = {"folder": cache.folder(), "kind": cache.folder() / "thing", "entry": cache.entry("thing", "a")}[place]
    where.chmod(where.stat().st_mode | bits)
    kept = cache.entry("thing", "a").read_bytes()
    with pytest.warns(RuntimeWarning, match=f"others can write to {where}.*PAPILLA_CACHE") as said:
        for _ in range(2):
            assert value_of() == 1.0
            assert cache.find("thing", "a", report=True) is None
    assert len(said) == 1 and "\n" not in str(said[0].message)
    assert cache.entry("thing", "a").read_bytes() == kept
    if place == "entry":  # The file that was opened is looked at, not only its name
        with pytest.raises(NotOwnError, match="others can write"):
            outside.own_bytes(where)


@NO_OWNERS
@pytest.mark.parametrize("place", ["folder", "kind", "entry"])
def test_links_of_the_user_are_followed_and_those_of_another_are_not(place, tmp_path, monkeypatch):
    cache.keep("thing", "a", Maker(666.0)())
    where = {"folder": cache.folder(), "kind": cache.folder() / "thing", "entry": cache.entry("thing", "a")}[place]
    where.rename(tmp_path / "elsewhere")
    where.symlink_to(tmp_path / "elsewhere")
    assert value_of() == 666.0
    if os.geteuid() == 0:
        os.chown(where, 12345, -1, follow_symlinks=False)
    else:
        monkeypatch.setenv("PAPILLA_CACHE", "/usr")
    with pytest.warns(RuntimeWarning, match="belongs to another user"):
        assert value_of() == 1.0


@NO_OWNERS
@pytest.mark.parametrize("umask", [0o000, 0o002, 0o077])
def test_folders_and_files_are_made_for_the_user_alone(umask, tmp_path, monkeypatch):
    """Also below a folder that all can write to, as /tmp, and the secret, which a copied cache does not bring."""
    (tmp_path / "shared").mkdir()
    (tmp_path / "shared").chmod(0o1777)
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "shared" / "cache"))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    before = os.umask(umask)
    try:
        value_of()
    finally:
        os.umask(before)
    modes = {path.name: stat.S_IMODE(path.stat().st_mode) for path in [cache.folder(), *cache.folder().rglob("*")]}
    secret = cache.secret_file()
    assert tmp_path / "data" in secret.parents and (secret.stat().st_mode | secret.parent.stat().st_mode) & 0o077 == 0
    assert modes == {"cache": 0o700, "thing": 0o700, "a.entry": 0o600, "a.entry.lock": 0o600}


def test_a_full_disk_does_not_refuse_what_was_computed(monkeypatch):
    assert cache.usable()

    def full(source, target):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(seams, "replace", full)
    with pytest.warns(RuntimeWarning, match="No space left on device"):
        assert value_of() == 1.0
    assert not cache.entries() and {path.suffix for path in cache.folder().rglob("*.*")} <= {".lock"}


def test_an_entry_is_sealed_by_the_secret_of_its_user_alone():
    """By a code that is keyed by the secret, of category, key and content; the line before it does not tell the
    secret."""
    cache.keep("thing", "a", Maker()())
    line, _, body = cache.entry("thing", "a").read_bytes().partition(b"\n")
    secret = cache.secret_file().read_bytes()
    name, seal = line.split()
    assert len(secret) == 32 and seal.decode() == hmac.new(secret, b"thing a\n" + body, "sha256").hexdigest()
    assert name.decode() == hmac.new(secret, b"name", "sha256").hexdigest()[:16]


@NO_OWNERS
def test_a_warning_points_at_the_line_that_asked(monkeypatch):
    cache.fetch("thing", "a", Maker())
    cache.entry("thing", "a").write_bytes(b"")
    with pytest.warns(RuntimeWarning, match="damaged") as damaged:
        cache.fetch("thing", "a", Maker())
    cache.folder().chmod(0o777)
    with pytest.warns(RuntimeWarning, match="others can write") as unsafe:
        cache.fetch("thing", "a", Maker())
    cache.folder().chmod(0o700)
    monkeypatch.setenv("PAPILLA_CACHE_PATIENCE_S", "0.01")
    with FileLock(f"{cache.entry('thing', 'b')}.lock"), pytest.warns(RuntimeWarning) as waited:
        cache.fetch("thing", "b", Maker(), give_up_s=0.01)
    assert [one[0].filename for one in (damaged, unsafe, waited)] == [__file__] * 3


def test_what_cannot_be_removed_is_named():
    cache.fetch("thing", "a", Maker())
    (cache.folder() / "thing" / "b.entry").mkdir()
    with pytest.raises(FileAccessError, match=r"cannot remove cache entry .*b\.entry"):
        cache.clean()
