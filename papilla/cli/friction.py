"""`--friction`, as every command that presses has it."""

from typing import Annotated

import typer

from papilla.specimen import DEFAULT_FRICTION, Friction, friction_coefficient

FrictionOption = Annotated[
    str | None,
    typer.Option(
        help=f"Coulomb friction between finger and specimen, or stick.  [default: {DEFAULT_FRICTION:g}]",
        metavar="0|MU|stick",
    ),
]


def read_friction(text: str | None) -> Friction:
    """The friction of an option's text; raises `InputError`."""
    if text is None:
        return DEFAULT_FRICTION
    try:
        friction: Friction = float(text)
    except ValueError:
        friction = text
    friction_coefficient(friction)
    return friction
