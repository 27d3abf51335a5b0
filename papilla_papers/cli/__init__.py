"""The commands `papilla reproduce` and `papilla figures`, which the command line finds by their entry point."""

from papilla.cli.output import CommandGroup
from papilla_papers.cli.figures import figures as _figures
from papilla_papers.cli.reproduce import reproduce as _reproduce

command_group = CommandGroup("", (_reproduce, _figures))
