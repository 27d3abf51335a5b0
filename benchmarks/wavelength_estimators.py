"""Some of the wavelength estimators side by side, at 1 kHz in held-out scenes: `papilla bench --estimators` runs all.

Run with `python benchmarks/wavelength_estimators.py space bank`: the words select estimators by their names.
"""

import argparse
import dataclasses

from papilla.cli.bench_estimators import print_tables
from papilla.studies.estimator_bench.plan import HELD_OUT, LONG
from papilla.studies.estimator_bench.runner import compare


def main() -> None:
    """Compare what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="parts of the estimators' names, none for all")
    parser.add_argument("--seeds", type=int, default=2, help="held-out seeds a scene")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    chosen = parser.parse_args()
    seeds = tuple(range(HELD_OUT, HELD_OUT + chosen.seeds))
    print_tables(compare(dataclasses.replace(LONG, names=tuple(chosen.names), seeds=seeds), workers=chosen.workers))


if __name__ == "__main__":
    main()
