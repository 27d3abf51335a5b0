"""Scenes and estimators of `estimator_comparison.py` by parts of their names, for whoever tunes one.

Run with `python benchmarks/wavelength_estimators.py --scenes hum late --methods pipeline --seeds 1 2 3`: seeds below
100 are for tuning, from 100 on every parameter of a scene is drawn.
"""

import argparse
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1]))
from benchmarks.estimator_comparison import print_scenes  # noqa: E402
from benchmarks.estimators.comparison import LONG, Plan, compare  # noqa: E402


def main() -> None:
    """Compare what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", nargs="*", default=(), help="parts of scenes' names, none for all")
    parser.add_argument("--methods", nargs="*", default=(), help="parts of estimators' names, none for all")
    parser.add_argument("--seeds", type=int, nargs="+", default=LONG.seeds, help="a run of each scene for each")
    parser.add_argument("--snr", type=float, default=LONG.snr_dB, help="texture over the noise of a sample, dB")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    chosen = parser.parse_args()
    plan = Plan(tuple(chosen.scenes), tuple(chosen.methods), tuple(chosen.seeds), snr_dB=chosen.snr)
    print_scenes(compare(plan, workers=chosen.workers))


if __name__ == "__main__":
    main()
