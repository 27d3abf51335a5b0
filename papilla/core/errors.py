"""One error tree: each error is a `PapillaError` and also the builtin error that a caller expects."""

import re

LONGEST_MESSAGE_LINE = 2000
"""Largest number of characters shown of a line: longer ones quote a damaged file, and would hide the message."""
MESSAGE_LEFT = 1900
"""Number of characters that are left of a longer message: with the words on what was left out it is no longer line."""


def one_line(text: str, characters: int = LONGEST_MESSAGE_LINE) -> str:
    """A text as one line: control characters, by which a name could take over the terminal, become visible escapes, and
    of one of more than `LONGEST_MESSAGE_LINE` characters all but `left` are left out in the middle."""
    text = re.sub(r"[\r\n\t]+\s*", " ", text).strip()
    if not text.isprintable():
        text = "".join(sign if sign.isprintable() else sign.encode("unicode_escape").decode() for sign in text)
    if len(text) <= LONGEST_MESSAGE_LINE:
        return text
    return f"{text[: characters // 2]} ... ({len(text) - characters} characters) ... {text[-(characters // 2) :]}"


class PapillaError(Exception):
    """Root of all errors that papilla raises; the message is one line, whatever it quotes."""

    def __init__(self, *parts: object) -> None:
        super().__init__(
            *(one_line(argument, MESSAGE_LEFT) if isinstance(argument, str) else argument for argument in parts)
        )


class InputError(PapillaError, ValueError):
    """A value cannot be used; the message names it, shows it and says what was expected."""


class FileFormatError(InputError):
    """A file can be read, but its content is wrong; the message names the file and the place in it."""


class FileAccessError(PapillaError, OSError):
    """A file or folder is missing, unreadable or cannot be written."""


class NotOwnError(FileAccessError, PermissionError):
    """Another user may have written what lies in a place from which papilla would use results."""


class MeshError(PapillaError, RuntimeError):
    """The mesher failed, or made a mesh that cannot be used."""


class SolverError(PapillaError, RuntimeError):
    """A linear or a contact solver did not reach its tolerance."""


class WorkerKilledError(PapillaError, RuntimeError):
    """A job's process was killed each time it was begun, as by the system when memory runs out."""


class MemoryEstimateError(PapillaError, MemoryError):
    """A computation needs more memory than is free; the message says how much, and what would fit."""


class ContactRangeError(InputError):
    """A press leaves the range of the model: it is too deep, or the contact reaches the rim of the patch."""


class MissingExtraError(PapillaError, ImportError):
    """An optional package is not installed; the message names the extra that installs it."""
