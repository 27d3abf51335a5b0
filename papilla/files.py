"""Atomic files: a reader finds the whole new file or what was there before, never a half."""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from papilla.errors import FileAccessError


@contextmanager
def replacing(path) -> Iterator[Path]:
    """A temporary path beside `path` to write to; it takes the place of `path` when the block ends without an error.

    Raises `FileAccessError` where the file cannot be written (no such folder, no permission, full disk).
    """
    target = Path(path).resolve()
    if target.exists() and not target.is_file():
        raise FileAccessError(f"cannot write {path}: it exists and is not a regular file")
    temporary = target.with_name(f".{target.name}.{os.getpid()}-{secrets.token_hex(4)}.tmp")
    try:
        yield temporary
        os.replace(temporary, target)
    except OSError as error:
        if isinstance(error, FileAccessError):
            raise
        raise FileAccessError(f"cannot write {path}: {error.strerror or error}") from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def write_text(path, text: str) -> None:
    """Write `text` (UTF-8) atomically; raises `FileAccessError`."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="")


def check_writable(folder) -> None:
    """Make `folder` where it is missing and see that a file can be created in it: before long work, not after.

    Raises `FileAccessError`.
    """
    folder = Path(folder)
    probe = folder / f".papilla-{os.getpid()}-{secrets.token_hex(4)}.tmp"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise FileAccessError(f"cannot write to folder {folder}: {error.strerror or error}") from error
