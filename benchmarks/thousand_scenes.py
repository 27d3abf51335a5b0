"""A thousand contact scenes from the cached reference mesh: assembly, factorisation and reduction included.

Run with `python benchmarks/thousand_scenes.py`; prints seconds a stage and the peak memory of the process.
"""

from papilla import mesh
from papilla.finger import Finger
from papilla.studies.bench.measure import peak_memory_MiB, set_up
from papilla.studies.bench.scenes import thousand


def main() -> None:
    """Time the set-up and the scenes, and print."""
    built = mesh.build(Finger.default())
    _, reduced, stages = set_up(Finger.default(), built)
    total, median = thousand(reduced, "contact")
    print(f"mesh: {len(built.cell().tets)} tetrahedra in the quarter, {len(reduced.patch.xy)} patch nodes")
    print(f"set-up {sum(stages.values()):.2f} s; 1000 scenes {total:.2f} s, median {1e3 * median:.2f} ms a scene")
    print(f"together {sum(stages.values()) + total:.2f} s, peak memory {peak_memory_MiB():.0f} MiB")


if __name__ == "__main__":
    main()
