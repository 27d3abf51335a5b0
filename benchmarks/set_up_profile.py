"""Where the set-up of a finger spends its time, and what bounds it: arithmetic or memory bandwidth of the machine.

Run with `python benchmarks/set_up_profile.py --size 0.7`; the mesh is cached and does not count. Functions are timed by
Python's profiler in one run, so their seconds add up to that run's.
"""

import argparse
import cProfile
import pstats
from time import perf_counter

from papilla import mesh
from papilla.fem import FingerModel
from papilla.finger import Finger
from papilla.studies.bench.limits import Machine, factor_bound, factor_flops, solve_bound
from papilla.studies.bench.scenes import thousand

PARTS = {
    "patch geometry and loads": ("patch.py", "build_patch"),
    "solves": ("solver.py", "solve"),
    "gauge rows": ("model.py", "_rows"),
    "half-space compliance": ("compliance.py", "half_space_compliance"),
}
"""What the reduction consists of: file and function."""


def main() -> None:
    """Print seconds a stage, and bounds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=float, default=mesh.DEFAULT_SIZE_MM, help="element size in mm")
    finger = Finger.default()
    built = mesh.build(finger, size_mm=parser.parse_args().size)
    model = FingerModel(finger, built)
    seconds = {}
    for name, step in (
        ("basis", lambda: model.space.displacement),
        ("assembly", lambda: model.matrix),
        ("factorisation", model.factor),
    ):
        began = perf_counter()
        step()
        seconds[name] = perf_counter() - began
    profile = cProfile.Profile()
    reduced = profile.runcall(model.reduce)
    for name, place in PARTS.items():
        seconds[name] = cumulative(profile, *place)
    seconds["rest of the reduction"] = pstats.Stats(profile).total_tt - sum(seconds[name] for name in PARTS)
    seconds["1000 contact scenes"] = thousand(reduced, "contact")[0]
    factor = model.factor()[1]
    columns = len(reduced.patch.xy)
    print(f"{factor.matrix.shape[0]:,} unknowns, {factor.nonzeros:,} entries of the factor, {columns} patch nodes")
    for name, value in seconds.items():
        print(f"{name:>28}{value:8.3f} s{100 * value / sum(seconds.values()):6.1f} %")
    machine = Machine.measured()
    print(f"machine: {machine.flops / 1e9:.0f} GFLOP/s, {machine.bandwidth / 1e9:.1f} GB/s")
    bounds = {
        "factorisation": factor_bound(factor_flops(factor.matrix), factor.nonzeros, machine),
        "solves": solve_bound(factor.nonzeros, columns, machine),
    }
    for name, bound in bounds.items():
        print(
            f"{name}: {bound.flops / 1e9:.1f} GFLOP, {bound.nbytes / 1e9:.2f} GB, at least {bound.seconds:.3f} s "
            f"by {bound.binding}; measured {seconds[name]:.3f} s, {seconds[name] / bound.seconds:.1f} times that"
        )


def cumulative(profile: cProfile.Profile, file: str, function: str) -> float:
    """Seconds spent in a function and what it calls."""
    stats = pstats.Stats(profile).stats
    return sum(entry[3] for (path, _, name), entry in stats.items() if name == function and path.endswith(file))


if __name__ == "__main__":
    main()
