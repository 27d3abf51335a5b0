"""Atomic writing of files, alone or as a set, and removal of temporary files that killed processes left behind.

The name of a temporary file or folder contains its machine and its process number. Once that process has ended, the
next write into the same folder removes the file.
"""

import json
import math
import os
import re
import secrets
import shutil
import socket
import stat
import tempfile
import time
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from os import PathLike
from pathlib import Path
from typing import Any

from papilla.core import seams
from papilla.core.errors import FileAccessError
from papilla.core.outside import reason, shown

_HOST = f"{zlib.crc32(socket.gethostname().encode()):08x}"
_TEMPORARY = re.compile(r"\.?.*papilla-([0-9a-f]{8})-(\d+)-[0-9a-f]{8}\.tmp")
_given: set[Path] = set()
"""Temporary paths that an open `replacing_set` has handed out."""

OLD_S = 86400.0  # Age of a temporary file of another machine, whose processes cannot be checked, at which it is removed


@contextmanager
def replacing(path: str | PathLike) -> Iterator[Path]:
    """A temporary path to write to; it replaces `path` when the block ends without an error.

    The permissions of an existing file are kept. Raises `FileAccessError` if the file cannot be written (no such
    folder, no permission, full disk).
    """
    if path in _given:
        # A path of an open set: `replacing_set` moves it with the others, and reports errors.
        yield path
        return
    with replacing_set([path]) as (temporary,):
        yield temporary


@contextmanager
def replacing_set(paths: Sequence[str | PathLike]) -> Iterator[list[Path]]:
    """Temporary paths for files that belong together; they replace the old files when the block ends without an error.

    Old and new files are never mixed, even if the process is killed: all old files but the first are removed before
    the new ones are moved. Functions that call `replacing` themselves may write to these paths. Raises
    `FileAccessError` as `replacing` does; the old files then remain.
    """
    targets = [target_of(path) for path in paths]
    temporaries = [_temporary(target) for target in targets]
    for folder in {target.parent for target in targets}:
        sweep(folder)
    try:
        modes = [stat.S_IMODE(target.stat().st_mode) if target.exists() else None for target in targets]
        for temporary, mode in zip(temporaries, modes, strict=True):
            if mode is not None:
                os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
        _given.update(temporaries)
        yield temporaries
        for temporary, mode in zip(temporaries, modes, strict=True):
            if mode is not None:
                temporary.chmod(mode)
        for target in targets[1:]:
            target.unlink(missing_ok=True)
        for temporary, target in zip(temporaries, targets, strict=True):
            seams.replace(temporary, target)
    except OSError as error:
        if isinstance(error, FileAccessError):
            raise
        pairs = zip(paths, temporaries, strict=True)
        at_fault = [str(path) for path, temporary in pairs if str(error.filename) in (str(path), str(temporary))]
        named = ", ".join(at_fault or map(str, paths))
        raise FileAccessError(f"cannot write {named}: {reason(error)}") from error
    finally:
        _given.difference_update(temporaries)
        for temporary in temporaries:
            with suppress(OSError):
                temporary.unlink()


def sidecar(path: str | PathLike, ending: str) -> Path:
    """The file that belongs to `path`: a.csv has a.<ending>; a.dat has a.dat.<ending>, for a.csv may have one, too."""
    path = Path(path)
    return path.with_name(f"{path.stem if path.suffix == '.csv' else path.name}.{ending}")


def write_text(path: str | PathLike, text: str) -> None:
    """Write `text` (UTF-8) atomically; raises `FileAccessError`."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="")


def toml_lines(content: Mapping[str, Any]) -> list[str]:
    """Keys and values of a TOML table, a line each."""
    return [f"{key} = {toml_value(value)}" for key, value in content.items()]


def toml_value(value: Any) -> str:
    """A value as TOML writes it; a list of lists has a line each. `papilla.core.outside.toml` reads it back."""
    if isinstance(value, dict):
        return "{ " + ", ".join(toml_lines(value)) + " }"
    if isinstance(value, list | tuple):
        rows, nested = [toml_value(item) for item in value], any(isinstance(item, tuple) for item in value)
        return "[\n  " + ",\n  ".join(rows) + ",\n]" if nested else f"[{', '.join(rows)}]"
    if value == math.inf:
        return "inf"
    # JSON writes text, booleans and finite numbers like TOML, except for signs that do not show
    text = json.dumps(value, ensure_ascii=False)
    return text if text.isprintable() else "".join(sign if sign.isprintable() else _escape(sign) for sign in text)


def _escape(sign: str) -> str:
    return f"\\u{ord(sign):04x}" if ord(sign) < 2**16 else f"\\U{ord(sign):08x}"


def check_writable(folder: str | PathLike) -> None:
    """Make `folder` if it is missing and create a file in it, so that a long computation does not fail at its end.

    Raises `FileAccessError`.
    """
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
        probe = _temporary(Path(folder) / "probe")
        probe.touch()
        probe.unlink()
    except (OSError, ValueError) as error:
        raise FileAccessError(f"cannot write to folder {shown(folder)}: {reason(error)}") from error


@contextmanager
def scratch(purpose: str) -> Iterator[Path]:
    """A folder in the system's temporary directory that exists during a block. Folders that killed processes left
    are removed first. Raises `FileAccessError` if the directory cannot be used."""
    with ExitStack() as stack:
        try:
            place = Path(tempfile.gettempdir())
            sweep(place)
            folder = _temporary(place / purpose)
            folder.mkdir(mode=0o700)
            stack.callback(shutil.rmtree, folder, ignore_errors=True)
        except OSError as error:
            raise FileAccessError(f"cannot use the temporary directory for {purpose}: {reason(error)}") from error
        yield folder


def sweep(folder: Path) -> None:
    """Remove from `folder` the temporary files and folders of this user's processes that have ended."""
    with suppress(OSError), os.scandir(folder) as entries:
        for item in entries:
            temporary = _TEMPORARY.fullmatch(item.name)
            with suppress(OSError):
                if temporary is None or not _left_behind(temporary[1], temporary[2], item.stat(follow_symlinks=False)):
                    continue
                if item.is_dir(follow_symlinks=False):
                    shutil.rmtree(item.path, ignore_errors=True)
                else:
                    os.unlink(item.path)


def _left_behind(host: str, process: str, status: os.stat_result) -> bool:
    if hasattr(os, "getuid") and status.st_uid != os.getuid():
        return False
    if host != _HOST or os.name == "nt":
        return time.time() - status.st_mtime > OLD_S
    try:
        os.kill(int(process), 0)
    except (ProcessLookupError, OverflowError):
        return True
    except OSError:
        pass
    return False


def _temporary(target: Path) -> Path:
    return target.with_name(f".{target.name[:100]}.papilla-{_HOST}-{os.getpid()}-{secrets.token_hex(4)}.tmp")


def target_of(path: str | PathLike) -> Path:
    """The file that is written where `path` is, which may be a link to it; raises `FileAccessError` if it cannot be."""
    try:
        target = Path(path).resolve()
        if target.exists() and not target.is_file():
            raise FileAccessError(f"cannot write {path}: it exists and is not a regular file")
    except FileAccessError:
        raise
    except (OSError, RuntimeError, ValueError) as error:
        # A loop of links is a RuntimeError to pathlib, a NUL a ValueError.
        raise FileAccessError(f"cannot write {shown(path)}: {reason(error)}") from error
    return target
