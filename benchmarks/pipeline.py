"""What a row of a log costs in the pipeline, output by output: five gauges to and fro at 1 kHz, bursts of NaN.

Run with `python benchmarks/pipeline.py [--calibration C.json]`; without a calibration there is no modulus.
"""

import argparse
from pathlib import Path

from papilla.calibration import Calibration
from papilla.studies.estimator_bench.cost import costs


def main() -> None:
    """Time the pipelines and print a line each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--calibration", type=Path, help="of five gauges (JSON)")
    parser.add_argument("--seconds", type=float, default=4.0, help="length of the log")
    chosen = parser.parse_args()
    print(f"{'microseconds':32s}{'block':>10s}{'update':>10s}{'mean':>10s}{'p99.9':>10s}{'of one run':>12s}")
    for cost in costs(Calibration.load(chosen.calibration) if chosen.calibration else None, chosen.seconds):
        *times, loop = (cost.block_us, cost.update_us, cost.update_mean_us, cost.update_p999_us, cost.loop_p999_us)
        print(f"{cost.output:32s}" + "".join(f"{value:10.1f}" for value in times) + f"{loop:12.1f}")


if __name__ == "__main__":
    main()
