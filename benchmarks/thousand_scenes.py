"""A thousand contact scenes from the cached reference mesh: assembly, factorisation and reduction included.

Run with `python benchmarks/thousand_scenes.py`; prints seconds a stage and the peak memory of the process.
"""

import resource
from time import perf_counter

import numpy as np

from papilla import fem, mesh
from papilla.finger import Finger
from papilla.specimen import Block

MODULI_MPA = np.geomspace(0.05, 0.72, 25)
FORCES_N = np.linspace(0.05, 1.0, 40)


def main() -> None:
    """Time the set-up and the scenes, and print."""
    finger = Finger.default()
    cached = mesh.build(finger)
    began = perf_counter()
    reduced = fem.FingerModel(finger, cached).reduce()
    set_up = perf_counter()
    seconds = []
    for modulus in MODULI_MPA:
        start = None
        for force in FORCES_N:
            scene = fem.press(reduced, Block(float(modulus), 10), force=float(force), fidelity="contact", start=start)
            start = scene.active
            seconds.append(scene.seconds)
    end = perf_counter()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"mesh: {len(cached.cell().tets)} tetrahedra in the quarter, {len(reduced.patch.xy)} patch nodes")
    print(f"assembly, factorisation, reduction: {set_up - began:.2f} s")
    print(f"{len(seconds)} scenes: {end - set_up:.2f} s, median {1e3 * np.median(seconds):.2f} ms a scene")
    print(f"together {end - began:.2f} s, peak memory {peak:.0f} MiB")


if __name__ == "__main__":
    main()
