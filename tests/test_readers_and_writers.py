"""What comes from outside passes through `core.outside`, and what is written through `core.files`: found in the
syntax trees of the package."""

import ast
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = sorted((ROOT / "papilla").rglob("*.py"))

READERS = (
    "open", "io.open*", "os.open", "os.fdopen", "codecs.open", "gzip.*", "bz2.*", "lzma.*", "zipfile.*", "tarfile.*",
    "json.load*", "tomllib.load*", "pickle.*", "marshal.*", "shelve.*", "dill.*", "cloudpickle.*", "joblib.load",
    "yaml.*", "csv.DictReader", "configparser.*", "xml.*", "sqlite3.connect", "ctypes.CDLL", "importlib.resources.*",
    "numpy.load", "numpy.genfromtxt", "numpy.fromfile", "numpy.memmap", "numpy.lib.format.*", "scipy.io.*",
    "meshio.read", "pyvista.read", "msgspec.*decode", "msgspec.*Decoder", "pyarrow.parquet.ParquetFile", "requests.*",
    "pyarrow.parquet.read_table", "rosbags.highlevel.AnyReader", "pandas.read_*", "urllib.*", "http.*", "eval", "exec",
    "compile", "simpleeval.*",
)  # fmt: skip
"""Functions, by the module that they are imported from, that read what papilla did not make itself."""
LISTENERS = (
    "socket.socket", "socket.create_*", "socketserver.*", "asyncio.start_server", "asyncio.open_connection",
    "http.server.*", "multiprocessing.managers.*", "multiprocessing.connection.*", "xmlrpc.*", "distributed.*",
    "dask.*",
)  # fmt: skip
METHODS = ("read_text", "read_bytes", "open", "recv", "recvfrom", "makefile", "fromfile")
WRITERS = (
    "numpy.save*", "json.dump", "os.write", "shutil.copy*", "shutil.move", "pyarrow.parquet.ParquetWriter",
    "pyarrow.parquet.write_*", "meshio.write",
)  # fmt: skip
WRITING_METHODS = ("write_text", "write_bytes", "savefig", "saving", "tofile", "to_csv", "rename", "symlink_to")
TEMPORARY = ("replacing", "replacing_set", "scratch")
"""Functions of `core.files` that give a temporary path: it replaces the file at the end, or goes with its folder."""

EXCEPTIONS = {
    ("papilla/mesh/worker.py", "*"): "a script of the child process, which cannot import papilla; it reads what its "
    "parent wrote into a folder of its own",
    ("papilla/cli/main.py", "*open"): "the null device stands for a closed standard stream; no other file is opened",
    ("papilla/core/cache.py", "numpy.savez_compressed"): "arrays are packed in memory, then written with `replacing`",
    ("papilla/design/cluster.py", "distributed.*"): "the one client of a scheduler that the user names, with its "
    "certificates; it opens no port, and what comes back is checked before it is stored",
    ("papilla/logs/bags.py", "rosbags.*"): "the library opens the file after `outside.checked_file` has judged it",
    ("papilla/logs/parquet.py", "pyarrow.*"): "the library opens the file after `outside.checked_file` has judged it",
    ("papilla/telepresence/udp.py", "?.recvfrom"): "one datagram of bounded size, of `outside.datagram_socket`",
}
"""(file, function) -> why it may stand there."""


def imported_names(tree: ast.AST) -> dict[str, str]:
    """Name in a module -> dotted name of what was imported, also inside functions."""
    names = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.asname or alias.name.split(".")[0]: alias.name if alias.asname else alias.name.split(".")[0]
                      for alias in node.names}  # fmt: skip
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names |= {alias.asname or alias.name: f"{node.module}.{alias.name}" for alias in node.names}
    return names


def dotted(node: ast.AST, names: dict[str, str]) -> str:
    """Dotted name of a function that is called; "?.read_text" for a method of some object."""
    first, *parts = ast.unparse(node).split(".")
    if first in names:
        return ".".join([names[first], *parts])
    return f"?.{node.attr}" if isinstance(node, ast.Attribute) else getattr(node, "id", "?")


def calls(code: str) -> Iterator[tuple[str, ast.Call, bool]]:
    """Each call in a module: its dotted name, its node, and whether it stands in a block with a temporary path."""
    tree = ast.parse(code)
    names = imported_names(tree)

    def walk(node: ast.AST, temporary: bool) -> Iterator[tuple[str, ast.Call, bool]]:
        if isinstance(node, ast.With):
            opened = {dotted(item.context_expr.func, names).split(".")[-1]
                      for item in node.items if isinstance(item.context_expr, ast.Call)}  # fmt: skip
            temporary = temporary or bool(opened & {*TEMPORARY})
        if isinstance(node, ast.Call):
            yield dotted(node.func, names), node, temporary
        for child in ast.iter_child_nodes(node):
            yield from walk(child, temporary)

    return walk(tree, False)


def writes(name: str, call: ast.Call) -> bool:
    """Whether a call writes a file; `open` does if its mode says so."""
    if name in ("open", "?.open"):
        stated = call.args[name == "open" :] + [word.value for word in call.keywords if word.arg == "mode"]
        modes = [str(mode.value) for mode in stated if isinstance(mode, ast.Constant)]
        return any({*mode} & {*"wax+"} and len(mode) < 4 for mode in modes)
    return name[2:] in WRITING_METHODS if name.startswith("?.") else any(fnmatch(name, pattern) for pattern in WRITERS)


def reads(name: str) -> bool:
    """Whether a call reads or listens to something from outside."""
    return name[2:] in METHODS if name.startswith("?.") else any(fnmatch(name, one) for one in READERS + LISTENERS)


def faults(code: str, file: str) -> list[str]:
    """The calls in a module that should be made by `papilla.core.outside` or `papilla.core.files`."""
    if file in ("papilla/core/outside.py", "papilla/core/files.py"):
        return []
    return [
        f"{file}:{call.lineno} reads or writes by {name}"
        for name, call, temporary in calls(code)
        if (not temporary if writes(name, call) else reads(name))
        and not any(place == file and fnmatch(name, pattern) for place, pattern in EXCEPTIONS)
    ]


def test_every_reader_listener_and_writer_goes_through_its_module():
    """A new one belongs into papilla/core/outside.py or papilla/core/files.py, with owner, type, bound and check."""
    found = [line for path in MODULES for line in faults(path.read_text(), path.relative_to(ROOT).as_posix())]
    assert found == []


def test_every_exception_is_needed_and_has_a_reason():
    for (file, pattern), why in EXCEPTIONS.items():
        names = [name for name, call, _ in calls((ROOT / file).read_text()) if reads(name) or writes(name, call)]
        assert any(fnmatch(name, pattern) for name in names), f"{file} has no {pattern}"
        assert len(why.split()) > 5


@pytest.mark.parametrize(
    "code",
    [
        "open(path)", "path.open()", "path.read_text()", "from json import loads as parse\nparse(text)", "eval(text)",
        "import numpy as np\nnp.load(path)", "def f():\n    import sqlite3\n    return sqlite3.connect(p)",
        "import socket\nsocket.socket()", "import msgspec\nmsgspec.msgpack.decode(b)", "Path(p).read_bytes()",
        "open(path, 'w')", "path.write_text(t)", "import numpy\nnumpy.savez(p)", "open(p, mode='a')",
    ],
)  # fmt: skip
def test_the_search_finds_each_kind(code):
    assert len(faults(code, "papilla/somewhere.py")) == 1


def test_a_write_to_a_temporary_path_is_none():
    code = "with replacing(path) as temporary, open(temporary, 'w') as stream:\n    temporary.write_text('')"
    assert faults(code, "papilla/somewhere.py") == []
    assert faults("Finger.load(path)\nlog.read(5)\ncache.fetch('a', 'b', c)", "papilla/somewhere.py") == []
