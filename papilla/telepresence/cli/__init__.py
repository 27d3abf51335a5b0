"""The commands of `papilla telepresence`, which the command line finds by their entry point."""

from papilla.cli.output import CommandGroup
from papilla.telepresence.cli.commands import simulate
from papilla.telepresence.cli.ends import display, sensor

command_group = CommandGroup(
    "telepresence",
    (simulate, sensor, display),
    "Remote touch over a delayed link: parameters of a texture are sent, not its signal; the display synthesises the "
    "touch.",
)
