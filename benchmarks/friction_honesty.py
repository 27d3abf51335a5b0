"""How often the stated sigma of friction holds, and how often "ok" is false, over drawn logs; the worst kinds first.

Run with `python benchmarks/friction_honesty.py [--first SEED] [--runs N]`. Seeds below 1000 are those of the tuning.
"""

import sys
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
import typer

from papilla.estimators import Friction

sys.path.append(str(Path(__file__).parents[1]))
from tests.support.friction_logs import NAMED, Judged, Rubbed, drawn, judge  # noqa: E402

FIRST = 30_000
EVERY = "every drawn log"


def judged(scene: Rubbed) -> tuple[Judged, float]:
    """A log's answers against the truth, and the processor time of a sample in microseconds."""
    estimator = Friction(sample_rate_Hz=scene.rate_Hz, **scene.options)
    begun = time.process_time()
    answer = estimator.process(scene.samples)
    return judge(scene, answer), 1e6 * (time.process_time() - begun) / len(scene.samples)


def row(name: str, found: list[tuple[Judged, float]]) -> tuple[float, str]:
    """The share inside two sigma, and the line of a kind."""
    columns = np.ma.masked_invalid([[*one, cost] for one, cost in found])
    answered, ok, inside, false, error, sigma, static, static_inside, cost = columns.T
    wrong = (ok * false).sum() / np.ma.maximum(ok.sum(), 1e-9)
    shares = (answered.mean(), ok.mean(), inside.mean(), wrong, np.ma.median(error), np.ma.median(sigma))
    figures = [float(np.ma.filled(own, np.nan)) for own in (*shares, static.mean(), static_inside.mean(), cost.mean())]
    return figures[2], f"{name:34s}{len(found):6d}" + "".join(f"{figure:10.3f}" for figure in figures)


def main(first: int = FIRST, runs: int = 400) -> None:
    """Judge drawn logs from a first seed on, and a tenth as many of each named kind; print each, the worst first."""
    kinds: dict[str, list[tuple[Judged, float]]] = defaultdict(list)
    for seed in range(first, first + runs):
        scene = drawn(seed)
        found = judged(scene)
        told = "offset told or to be learnt" if scene.told else "offset left to its prior"
        labels = [f"{what}: {kind}" for what, kind in zip(("moves", "pressed", "mu"), scene.kinds, strict=True)]
        for label in (EVERY, told, f"{scene.rate_Hz:g} Hz", *labels):
            kinds[label].append(found)
    for make in NAMED.values():
        for seed in range(first, first + max(runs // 10, 1)):
            scene = make(seed)
            kinds[scene.kinds[0]].append(judged(scene))
    titles = ("answered", "ok", "inside", "false", "error", "sigma", "static", "inside", "us")
    print(f"{'kind of log':34s}{'runs':>6s}" + "".join(f"{title:>10s}" for title in titles))
    for _, line in sorted(row(name, found) for name, found in kinds.items()):
        print(line)


if __name__ == "__main__":
    typer.run(main)
