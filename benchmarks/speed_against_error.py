"""Speed against error of fidelities, elements, meshes, and beside other libraries: table and plot of `papilla bench`.

Run with `python benchmarks/speed_against_error.py [--short]`; options are those of the command.
"""

import sys

from papilla.cli.main import run

if __name__ == "__main__":
    run(["bench", *sys.argv[1:]])
