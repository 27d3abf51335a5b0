"""`--friction`, as every command that presses has it."""

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from papilla.specimen import Friction

FrictionOption = Annotated[
    str | None,
    typer.Option(help="Coulomb friction between finger and specimen, or stick.  [default: 0]", metavar="0|MU|stick"),
]


def read_friction(text: str | None) -> "Friction":
    """The friction of an option's text; raises `InputError`."""
    from papilla.specimen import DEFAULT_FRICTION, friction_coefficient

    if text is None:
        return DEFAULT_FRICTION
    try:
        friction: Friction = float(text)
    except ValueError:
        friction = text
    friction_coefficient(friction)
    return friction
