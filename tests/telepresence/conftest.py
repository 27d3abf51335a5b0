"""The command line in this process."""

from command_fixtures import papilla as papilla
from command_fixtures import refused as refused
