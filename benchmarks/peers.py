"""One press by FElupe and NGSolve beside papilla's set-up and a thousand drawn scenes, on one mesh in one run.

Run with `python benchmarks/peers.py`, with `--size 1.4` for a short form; needs the extra `peers`. The whole finger is
meshed as well as the quarter that its mirrors leave: papilla uses the mirrors in either case, and general libraries
know them as boundary conditions.
"""

import argparse

from papilla import mesh
from papilla.finger import Finger
from papilla.studies.bench.measure import set_up
from papilla.studies.bench.peers import missing_peers, run_peers
from papilla.studies.bench.scenes import thousand


def main() -> None:
    """Time papilla, then the peers, and print every figure of theirs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=float, default=mesh.DEFAULT_SIZE_MM, help="element size at the contact, mm")
    parser.add_argument("--threads", type=int, default=2)
    chosen = parser.parse_args()
    finger = Finger.default()
    built = mesh.build(finger, size_mm=chosen.size)
    runs = ((sum(stages.values()), thousand(reduced, "contact")[0])
            for _, reduced, stages in (set_up(finger, built) for _ in range(2)))  # fmt: skip
    ready, scenes = min(runs, key=sum)
    print(f"papilla: set-up {ready:.2f} s, 1000 scenes {scenes:.2f} s, together {ready + scenes:.2f} s", flush=True)
    for sentence in missing_peers():
        print(sentence)
    for row in run_peers(finger, built, threads=chosen.threads):
        ratio = (ready + scenes) / row.seconds_one_press
        print(
            f"{row.name}: one press takes {row.seconds_one_press:.2f} s, papilla's set-up and 1000 scenes {ratio:.3f}"
        )
        for name, value in ({"ratio": ratio} | row.to_json()).items():
            print(f"    {name}: {value}")


if __name__ == "__main__":
    main()
