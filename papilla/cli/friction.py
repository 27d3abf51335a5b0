"""`--friction`, as every command that presses has it."""

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from papilla.specimen import Friction

FrictionOption = Annotated[
    str | None,
    typer.Option(
        help="Coulomb friction between finger and specimen, or stick.  [default: not known, stick the likeliest]",
        metavar="0|MU|stick",
    ),
]


def read_friction(text: str | None) -> "Friction | None":
    """The friction of an option's text, None where it is not given; raises `InputError`."""
    from papilla.specimen import friction_coefficient

    if text is None:
        return None
    try:
        friction: Friction = float(text)
    except ValueError:
        friction = text
    friction_coefficient(friction)
    return friction
