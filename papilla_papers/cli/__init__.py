"""The commands `papilla reproduce` and `papilla figures`, which the command line finds by their entry point."""

from papilla_papers.cli.figures import figures as _figures
from papilla_papers.cli.reproduce import reproduce as _reproduce

GROUP = HELP = ""
COMMANDS = (_reproduce, _figures)
