"""What a row of a log costs in the pipeline, output by output: five gauges to and fro at 1 kHz, bursts of NaN.

Run with `python benchmarks/pipeline.py [--calibration C.json]`; without a calibration there is no modulus.
"""

import sys
from pathlib import Path

import typer

from papilla.calibration import Calibration

sys.path.append(str(Path(__file__).parents[1]))
from benchmarks.estimators.cost import costs  # noqa: E402


def main(calibration: Path | None = None, seconds: float = 4.0) -> None:
    """Time the pipelines on a log of so many seconds and print a line each; a calibration is of five gauges."""
    print(f"{'microseconds':32s}{'block':>10s}{'update':>10s}{'mean':>10s}{'p99.9':>10s}{'of one run':>12s}")
    for cost in costs(Calibration.load(calibration) if calibration else None, seconds):
        *times, loop = (cost.block_us, cost.update_us, cost.update_mean_us, cost.update_p999_us, cost.loop_p999_us)
        print(f"{cost.output:32s}" + "".join(f"{value:10.1f}" for value in times) + f"{loop:12.1f}")


if __name__ == "__main__":
    typer.run(main)
