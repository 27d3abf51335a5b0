"""One press by FElupe and NGSolve beside papilla's set-up and a thousand scenes, on the same mesh in the same run.

Run with `python benchmarks/peers.py`, with `--size 1.4` for a short form, with `--json` for all figures; needs the
extra `peers`. The whole finger is meshed as well as the quarter that its mirrors leave: papilla uses the mirrors in
either case, and general libraries know them as boundary conditions.
"""

import argparse
import json
from time import perf_counter

import numpy as np

from papilla import fem, mesh
from papilla.finger import Finger
from papilla.specimen import Block
from papilla.studies.bench.peers import missing_peers, run_peers

MODULI_MPA = np.geomspace(0.05, 0.72, 25)
FORCES_N = np.linspace(0.05, 1.0, 40)

COLUMNS = ("name", "press s", "assembly s", "systems", "unknowns", "force %", "S_d %", "tenfold penalty %", "ratio")


def main() -> None:
    """Time papilla, then the peers, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=float, default=mesh.DEFAULT_SIZE_MM, help="element size at the contact, mm")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--json", action="store_true")
    chosen = parser.parse_args()
    finger = Finger.default()
    built = mesh.build(finger, size_mm=chosen.size)
    set_up, scenes = min((thousand_scenes(finger, built) for _ in range(2)), key=sum)
    for sentence in missing_peers():
        print(sentence)
    found = run_peers(finger, built, threads=chosen.threads)
    rows = [item.to_json() | {"ratio": (set_up + scenes) / item.seconds_one_press} for item in found]
    if chosen.json:
        print(json.dumps({"seconds_setup": set_up, "seconds_1000_scenes": scenes, "peers": rows}, indent=2))
    else:
        show(rows, set_up, scenes)


def thousand_scenes(finger: Finger, built: mesh.LayeredMesh) -> tuple[float, float]:
    """Seconds of assembly, factorisation and reduction, and of 1000 contact scenes thereafter."""
    began = perf_counter()
    reduced = fem.FingerModel(finger, built).reduce()
    ready = perf_counter()
    for modulus in MODULI_MPA:
        start = None
        for force in FORCES_N:
            block = Block(float(modulus), 10)
            start = fem.press(reduced, block, force=float(force), fidelity="contact", start=start).active
    return ready - began, perf_counter() - ready


def show(rows: list[dict], set_up: float, scenes: float) -> None:
    """Print the table."""
    print(f"papilla: set-up {set_up:.2f} s, 1000 scenes {scenes:.2f} s, together {set_up + scenes:.2f} s")
    print("{:>40} {:>8} {:>11} {:>8} {:>9} {:>8} {:>8} {:>18} {:>8}".format(*COLUMNS))
    for row in rows:
        print(
            f"{row['name']:>40} {row['seconds_one_press']:8.2f} {row['seconds_assembly']:11.2f} {row['systems']:8d} "
            f"{row['unknowns']:9d} {100 * row['difference']:8.3f} {100 * row['difference_sd']:8.3f} "
            f"{100 * row['penalty_change']:18.3f} {row['ratio']:8.3f}"
        )
    if rows:
        fastest = min(rows, key=lambda row: row["seconds_one_press"])
        print(f"papilla's set-up and 1000 scenes take {fastest['ratio']:.3f} of one press by {fastest['name']}")


if __name__ == "__main__":
    main()
