"""The commands of `papilla telepresence`, which the command line finds by their entry point."""

from papilla.telepresence.cli.commands import simulate
from papilla.telepresence.cli.ends import display, sensor

GROUP = "telepresence"
HELP = (
    "Remote touch over a delayed link: parameters of a texture are sent, not its signal; the display synthesises the "
    "touch."
)
COMMANDS = (simulate, sensor, display)
