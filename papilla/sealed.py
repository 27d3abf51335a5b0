"""JSON files with a schema and a checksum of their values: whether a file was edited after papilla wrote it."""

import hashlib
import json
import re
from pathlib import Path
from typing import Any

from papilla.errors import FileAccessError, FileFormatError
from papilla.files import write_text

CHECKSUM = "content_sha256"
NO_CHECKSUM = "the file has no checksum: nothing tells whether it is as papilla wrote it"
EDITED = "the file was changed after papilla wrote it: its checksum does not match, so nothing vouches for its answers"


def write_sealed(document: dict[str, Any], path: Path) -> None:
    """Write a document with its checksum, whole or not at all; raises `FileAccessError`."""
    text = json.dumps(document | {CHECKSUM: checksum(document)}, indent=1, allow_nan=False, ensure_ascii=False)
    # Innermost lists of numbers on one line each: a row of coefficients is a line.
    text = re.sub(r"\[\s+([^\[\]{}\"]*?)\s+\]", lambda match: "[" + " ".join(match[1].split()) + "]", text)
    write_text(path, text + "\n")


def read_sealed(path: Path, schema: str, what: str) -> tuple[dict[str, Any], str]:
    """The document of a file without its checksum, and a remark: empty where it is as papilla wrote it.

    what : it is, in words. Raises `FileAccessError`, or `FileFormatError` for what is no such document.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FileAccessError(f"cannot read {what} {path}: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:
        raise FileFormatError(f"{path} is not a {what}, or was cut short: not valid JSON ({error})") from error
    stated = document.get("schema") if isinstance(document, dict) else None
    if stated != schema:
        raise FileFormatError(f"{path}: the schema is {stated!r}, this version of papilla reads {schema!r}")
    seal = document.pop(CHECKSUM, None)
    if seal == checksum(document):
        return document, ""
    return document, NO_CHECKSUM if seal is None else EDITED


def checksum(document: dict[str, Any]) -> str:
    """SHA-256 of a document's values, whatever the spaces and the order of its keys."""
    text = json.dumps(document, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
