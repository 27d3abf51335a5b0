"""A command's inputs stay what they are: an output that is one of them is refused before any work."""

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from papilla.errors import InputError

if TYPE_CHECKING:
    from papilla.finger import Finger


def keep_inputs(inputs: Iterable[Path | str | None], outputs: Iterable[Path]) -> None:
    """Refuse an output that is an input under whatever name: through links, other spellings, a second hard link."""
    given = [Path(name) for name in inputs if name is not None]
    for output in outputs:
        for name in given:
            if _same(name, output):
                raise InputError(f"{output} would overwrite the input {name}: choose another name")


def surface_files(design: "Finger") -> list[str]:
    """The files of a design's surfaces."""
    from papilla.finger import Surfaces

    return [*vars(design.shape).values()] if isinstance(design.shape, Surfaces) else []


@contextmanager
def about(path: Path) -> Iterator[None]:
    """Bad input that is found while the content of a file is used names the file, as that found while reading does."""
    try:
        yield
    except InputError as error:
        raise InputError(str(error) if str(path) in str(error) else f"{path}: {error}") from error


def _same(one: Path, other: Path) -> bool:
    if os.path.realpath(one) == os.path.realpath(other):
        return True
    try:
        return os.path.samefile(one, other)
    except OSError:
        return False
