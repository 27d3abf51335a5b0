"""One error tree: every error of papilla is a `PapillaError` and also the builtin that a caller would expect."""


class PapillaError(Exception):
    """Root of all errors that papilla raises on purpose; the message is one clear line."""


class InputError(PapillaError, ValueError):
    """A value is not usable: the message names it, shows it, and says what was expected."""


class FileFormatError(InputError):
    """A file could be read but does not hold what it should; the message names file and place."""


class FileAccessError(PapillaError, OSError):
    """A file or folder is missing, unreadable or cannot be written."""


class MeshError(PapillaError, RuntimeError):
    """The mesher failed, or produced a mesh that must not be used."""


class SolverError(PapillaError, RuntimeError):
    """A linear or contact solve did not reach its tolerance."""


class MemoryEstimateError(PapillaError, MemoryError):
    """A job would need more memory than is free; the message says how much, and what would fit."""


class ContactRangeError(InputError):
    """The press leaves what the model covers: too deep, or the contact reaches the rim of its patch."""


class MissingExtraError(PapillaError, ImportError):
    """An optional dependency is absent; the message says which extra to install."""
