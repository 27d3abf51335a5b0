"""`python -m papilla` is the command line."""

from papilla.cli.main import run

if __name__ == "__main__":
    run()
