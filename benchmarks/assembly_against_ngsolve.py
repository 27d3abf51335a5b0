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
    finger = Finger.default()
    built = mesh.build(finger, size_mm=parser.parse_args().size)
    found = compare_assembly(finger, built)
    print(f"{len(built.tets)} tetrahedra, {found.unknowns} unknowns, NGSolve with {found.threads} threads")
    for title, ours, theirs, ratio in (
        ("first assembly", found.seconds_papilla, found.seconds_ngsolve, found.ratio),
        ("other moduli", found.seconds_papilla_again, found.seconds_ngsolve_again, found.ratio_again),
    ):
        print(f"{title:>15}: papilla {ours:.3f} s, NGSolve {theirs:.3f} s, ratio {ratio:.2f}")


if __name__ == "__main__":
    main()
