"""The commands `papilla reproduce` and `papilla figures`, which the command line finds by their entry point."""

from papilla_papers.cli.figures import figures
from papilla_papers.cli.reproduce import reproduce

GROUP = HELP = ""
COMMANDS = (reproduce, figures)
