"""Where the set-up of a finger spends its time, and what bounds it: arithmetic or memory bandwidth of the machine.

Run with `python benchmarks/set_up_profile.py --size 0.7`; the mesh is cached and does not count. Functions are timed by
Python's profiler in one run, so their seconds add up to that run's.
"""

import argparse
import cProfile
import pstats

from papilla import mesh
from papilla.finger import Finger
from papilla.studies.bench.limits import Machine, bounds_of, factor_flops
from papilla.studies.bench.measure import set_up
from papilla.studies.bench.scenes import thousand

PARTS = {
    "patch geometry and loads": ("patch.py", "build_patch"),
    "solves": ("solver.py", "solve"),
    "gauge rows": ("finger_model.py", "rows"),
    "half-space compliance": ("compliance.py", "half_space_compliance"),
}
"""What the reduction consists of: file and function."""


def main() -> None:
    """Print seconds a stage, and bounds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=float, default=mesh.DEFAULT_SIZE_MM, help="element size in mm")
    finger = Finger.default()
    built = mesh.build(finger, size_mm=parser.parse_args().size)
    profile = cProfile.Profile()
    model, reduced, seconds = profile.runcall(set_up, finger, built)
    for name, place in PARTS.items():
        seconds[name] = cumulative(profile, *place)
    seconds["rest of the reduction"] = seconds.pop("reduction") - sum(seconds[name] for name in PARTS)
    seconds["1000 contact scenes"] = thousand(reduced, "contact")[0]
    factor = model.factor()[1]
    columns = len(reduced.patch.xy)
    print(f"{factor.matrix.shape[0]:,} unknowns, {factor.nonzeros:,} entries of the factor, {columns} patch nodes")
    for name, value in seconds.items():
        print(f"{name:>28}{value:8.3f} s{100 * value / sum(seconds.values()):6.1f} %")
    machine = Machine.measured()
    print(f"machine: {machine.flops / 1e9:.0f} GFLOP/s, {machine.bandwidth / 1e9:.1f} GB/s")
    for name, bound in bounds_of(factor_flops(factor.matrix), factor.nonzeros, columns, machine).items():
        print(bound.sentence(name, seconds[name]))


def cumulative(profile: cProfile.Profile, file: str, function: str) -> float:
    """Seconds spent in a function and what it calls."""
    stats = pstats.Stats(profile).stats
    return sum(entry[3] for (path, _, name), entry in stats.items() if name == function and path.endswith(file))


if __name__ == "__main__":
    main()
