"""A thousand contact scenes from the cached reference mesh, assembly, factorisation and reduction included; and what a
scene costs by each fidelity when every one has a modulus and a force of its own.

Run with `python benchmarks/thousand_scenes.py`; prints seconds a stage and the peak memory of the process.
"""

import numpy as np

from papilla import mesh
from papilla.fem import prepare
from papilla.finger import Finger
from papilla.studies.bench.measure import peak_memory_MiB, set_up
from papilla.studies.bench.scenes import drawn, thousand, warm_grid

DRAWN = {
    "linear, without friction": {"fidelity": "contact", "friction": 0},
    "default (stuck, large strain)": {},
    "hertz": {"fidelity": "hertz"},
}
SCENES = 300


def main() -> None:
    """Time the set-up and the scenes, and print."""
    built = mesh.build(Finger.default())
    _, reduced, stages = set_up(Finger.default(), built)
    total, median = thousand(reduced, "contact")
    print(f"mesh: {len(built.cell().tets)} tetrahedra in the quarter, {len(reduced.patch.xy)} patch nodes")
    print(f"set-up {sum(stages.values()):.2f} s; 1000 drawn scenes {total:.2f} s, median {1e3 * median:.2f} ms a scene")
    print(f"together {sum(stages.values()) + total:.2f} s, peak memory {peak_memory_MiB():.0f} MiB")
    total, median = warm_grid(reduced, "contact")
    print(f"a sweep of 25 moduli x 40 forces: {total:.2f} s, median {1e3 * median:.2f} ms a scene")
    loaded = prepare(Finger.default())
    for name, how in DRAWN.items():
        first, *seconds = 1e3 * np.array(drawn(loaded, SCENES, seed=1, **how))
        middle, tenth = np.median(seconds), np.quantile(seconds, 0.9)
        print(
            f"{SCENES} drawn scenes, {name}: median {middle:.3f} ms of processor, mean {np.mean(seconds):.3f}, "
            f"90 % below {tenth:.3f}; the first {first:.0f}"
        )


if __name__ == "__main__":
    main()
