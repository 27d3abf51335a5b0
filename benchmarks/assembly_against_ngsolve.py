"""Assembly of the Taylor-Hood matrix of the whole default finger, papilla's against NGSolve's with two threads.

Run with `python benchmarks/assembly_against_ngsolve.py --size 0.7`; needs the extra `peers`.
"""

import argparse

from papilla import mesh
from papilla.finger import Finger
from papilla.studies.bench.peers import compare_assembly


def main() -> None:
    """Time both, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=float, default=mesh.DEFAULT_SIZE_MM, help="element size at the contact, mm")
    built = mesh.build(Finger.default(), size_mm=parser.parse_args().size)
    unknowns, seconds = compare_assembly(Finger.default(), built, threads=2)
    print(f"{len(built.tets)} tetrahedra, {unknowns} unknowns, NGSolve with 2 threads")
    for number, title in enumerate(("first assembly", "other moduli")):
        ours, theirs = (seconds[name][number] for name in ("papilla", "NGSolve"))
        print(f"{title:>15}: papilla {ours:.3f} s, NGSolve {theirs:.3f} s, ratio {ours / theirs:.2f}")


if __name__ == "__main__":
    main()
