"""JSON files with a schema and a checksum of their values, which shows whether a file was edited."""

import hashlib
import json
import re
import reprlib
from pathlib import Path
from typing import Any

from papilla.core.errors import FileFormatError
from papilla.core.files import write_text
from papilla.core.outside import read_json

CHECKSUM_KEY = "content_sha256"
NO_CHECKSUM = "the file has no checksum, so papilla cannot say whether it was edited"
EDITED_MESSAGE = "the file was changed after papilla wrote it: its checksum does not match, so its answers may be wrong"


def write_sealed(document: dict[str, Any], path: Path) -> None:
    """Write a document and its checksum atomically; raises `FileAccessError`."""
    text = json.dumps(document | {CHECKSUM_KEY: checksum(document)}, indent=1, allow_nan=False, ensure_ascii=False)
    # Write each innermost list of numbers on one line: a row of coefficients is one line.
    text = re.sub(r"\[\s+([^\[\]{}\"]*?)\s+\]", lambda match: "[" + " ".join(match[1].split()) + "]", text)
    write_text(path, text + "\n")


def read_sealed(path: Path, schema: str, what: str) -> tuple[dict[str, Any], str]:
    """The document in a file, without its checksum, and a note that is empty if the checksum matches.

    what : kind of document, for messages. Raises `FileAccessError`; `FileFormatError` if the file is no such document.
    """
    document = read_json(path, what)
    stated = document.get("schema") if isinstance(document, dict) else None
    if stated != schema:
        raise FileFormatError(f"{path}: the schema is {reprlib.repr(stated)}, this version of papilla reads {schema!r}")
    seal = document.pop(CHECKSUM_KEY, None)
    if seal == checksum(document):
        return document, ""
    return document, NO_CHECKSUM if seal is None else EDITED_MESSAGE


def checksum(document: dict[str, Any]) -> str:
    """SHA-256 of a document's values; spaces and the order of keys do not matter."""
    text = json.dumps(document, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
