"""`Figure`: a figure or table of a paper that papilla can compute, and the papers with theirs."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from papilla.studies.figures.picture import Picture


@dataclass(frozen=True)
class Figure:
    """A published figure.

    name : as the paper numbers it, "fig. 5". make : computes it; its docstring is the caption: a heading, the method,
    and differences from print. claims : keys of claims of `papilla reproduce` about it. group : figures of one group
    share computations and run in one process, one after the other.
    """

    name: str
    make: Callable[[], Picture]
    claims: tuple[str, ...] = ()
    group: str = ""

    @property
    def title(self) -> str:
        """The content of the figure, in a line."""
        return inspect.cleandoc(self.make.__doc__ or "").split("\n")[0].rstrip(".")

    @property
    def caption(self) -> str:
        """The method, and differences from print."""
        return " ".join(inspect.cleandoc(self.make.__doc__ or "").split("\n")[1:]).strip()

    @property
    def stem(self) -> str:
        """Its name in a file name: "fig_5"."""
        return self.name.replace(".", "").replace(" ", "_").replace("(", "").replace(")", "").lower()


@dataclass(frozen=True)
class Paper:
    """title : of the paper, in short. figures : in its order. left_out : figures that are not drawn, by name, with the
    reason."""

    title: str
    figures: tuple[Figure, ...]
    left_out: Mapping[str, str]
