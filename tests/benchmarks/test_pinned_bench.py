"""Benchmarks and simulations on made-up presses, slides and clocks give the rows that they gave.

`python tests/benchmarks/test_pinned_bench.py [part ...]` (with tests/support on the path) writes the present rows, for
a change that moves them on purpose.
"""

import itertools
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import made_up_finger
import numpy as np
import pinned
import pytest
from spring_calibration import calibration

from benchmarks.estimators import cost, touches
from benchmarks.presses.peers import runner as peer_runner
from papilla.cli.speed import measure, runner
from papilla.core.errors import ContactRangeError
from papilla.model.finger import Finger
from papilla.scenes import parts as scene_parts
from papilla.scenes import scenes
from papilla.telepresence.messages import Parameters
from papilla.verify.structured import cube
from papilla_papers import telepresence
from papilla_papers.claims.experiments import telepresence as experiment
from papilla_papers.claims.experiments import wavelets

KEPT = Path(__file__).with_name("pinned_bench.json")


def clock(step: float = 1e-3):
    """A clock that goes on by other steps each time it is read."""
    ticks = itertools.count(1)
    now = itertools.accumulate(step * (1 + (k * 7) % 5) for k in ticks)
    return lambda: next(now)


def _measure(patch):
    asked = []

    class Model:
        def __init__(self, design, mesh, element):
            asked.append((design.name, mesh.name, element))
            self.space, self.matrix = SimpleNamespace(displacement="basis"), "matrix"

        def factor(self):
            return np.array([True, True, False]), SimpleNamespace(nonzeros=77)

        def reduce(self):
            return made_up_finger.prepare()

    class Taylor:
        def __init__(self, cell):
            self.cell = cell

        def free(self, parity, mirrors):
            return np.array([parity == measure.SYMMETRIC, mirrors == "xy", self.cell == "cell", False])

    def press(reduced, specimen, *, force, fidelity="contact"):
        if fidelity == "hertz" and force > 0.95:
            raise ContactRangeError("too firm")
        return made_up_finger.press(reduced, specimen, force=force, fidelity=fidelity)

    def finite(design, mesh, specimen, *, force):
        if mesh.name == "coarse" and force > 0.5:
            raise ContactRangeError("too far")
        found = made_up_finger.press(made_up_finger.prepare(), specimen, force=force, fidelity="finite")
        found.seconds = 2 + force
        return found

    def build(design, size_mm):
        return SimpleNamespace(name="coarse" if size_mm > 2 else "mesh", cell=lambda: "cell", mirrors="xy")

    patch.setattr(measure.meshes, "build", build)
    patch.setattr(measure, "FingerModel", Model)
    patch.setattr(measure, "TaylorHood", Taylor)
    patch.setattr(measure, "press", press)
    patch.setattr(measure, "press_finite", finite)
    patch.setattr(measure, "peak_memory_MiB", lambda: 123.0)
    patch.setattr(measure, "SCENES", 11)
    patch.setattr(measure, "perf_counter", clock(0.1))
    patch.setattr(measure, "process_time", clock())
    finger = Finger.default()
    rows = measure.measure(finger, 1.4, "P1") + measure.measure(finger, 1.4, "P1", (10, 30))
    rows += measure.measure(finger, 1.4, None, (10, 30)) + measure.measure(finger, 2.8, None, (10, 80))
    seconds = measure.drawn(made_up_finger.prepare(), 5, 3, fidelity="contact")
    return rows, asked, seconds, rows[0].to_json()


def _drawn_presses(patch):
    """Which presses are drawn."""
    pressed = []

    def press(reduced, specimen, *, force, **how):
        if force > 0.97:
            raise ContactRangeError("too firm")
        pressed.append((specimen.modulus, specimen.thickness, force, how))

    patch.setattr(measure, "press", press)
    measure.drawn(None, 4, 1, fidelity="hertz")
    return pressed


def _bench(patch):
    plan, told, built = replace(runner.SHORT, finite_sizes_mm=runner.SHORT.sizes_mm), [], []

    def apart(design, size, element, forces):
        how = {"hertz": 0.03, "contact": 0.01, "finite": 0.02}
        base = np.outer([1000.0, 0.5, 20.0], np.asarray(forces, float) ** 0.6)
        kinds = ("finite",) if element is None else ("hertz", "contact")
        return [
            runner.BenchRow(
                kind, element or runner.DEFAULT_ELEMENT, size, tuple(forces), round(1000 / size), 40, 99,
                {"basis": 0.1 / size}, 1e-3 / size, 1.0 / size + 3 * (kind == "contact"), 50.0,
                base * (1 + how[kind] * size * np.arange(1, 4)[:, None] * (1 + (element == "P1"))),
                "refused: too far" if kind == "hertz" and element == "P1" else measure.ANSWERED,
            )
            for kind in kinds
        ]  # fmt: skip

    patch.setattr(runner, "measure_apart", apart)
    patch.setattr(runner.meshes, "build", lambda design, size_mm, progress=None: built.append(size_mm) or "mesh")
    patch.setattr(runner.os, "cpu_count", lambda: 3)
    found = runner.bench(Finger.default(), plan, progress=told.append)
    return found.rows, found.sentences(), found.default, told, built


def _cost(patch):
    made = calibration()
    known = cost._log(1.5, made)
    patch.setattr(cost.time, "perf_counter", clock(1e-5))
    sizes = []

    class Estimator:
        def process(self, rows):
            sizes.append(len(rows))

        def update(self, row):
            assert len(row) == 3

    found = cost.timed(Estimator, np.zeros((1234, 3)))
    asked = []

    def timed(make, rows):
        asked.append((rows.shape, str(make.keywords), make.args and "calibrated"))
        return tuple(np.arange(5.0) + len(asked))

    patch.setattr(cost, "timed", timed)
    return known, cost._log(1.5, None), found, sizes, cost.costs(made, 0.5), cost.costs(None, 0.5), asked


def _touches(patch):
    made, force = calibration(), touches.forces()[touches.AIR :]
    rng = lambda: np.random.default_rng(1)  # noqa: E731
    readings = np.outer(np.linspace(0, 1, 60), np.arange(1.0, 6.0))
    effects = {name: touch.disturbances for name, touch in touches.TOUCHES.items()}
    done = {name: [act(rng(), readings, np.linspace(-0.1, 1, 60)) for act in acts] for name, acts in effects.items()}
    block = np.column_stack([made.predict_readings(np.maximum(force, 0.06), 0.3), force])
    block = np.vstack([np.zeros((touches.AIR, 6)), block])
    answers = {name: method(made, block, touches.Doubts()) for name, method in touches.METHODS.items()}
    asked = []

    def sweep(reduced, moduli, levels, block, **how):
        asked.append((list(moduli), len(levels), repr(block), reduced.at, reduced.stiff, how))
        return made_up_finger.sweep(reduced, moduli, levels, block)

    patch.setattr(touches, "prepare", made_up_finger.prepare)
    patch.setattr(touches, "sweep", sweep)
    finger = Finger.default()
    some = {name: touches.pressed(finger, touch, [0.1, 0.3], force[::20]) for name, touch in touches.TOUCHES.items()
            if not touch.exact}  # fmt: skip
    told = []

    def pressed(finger, touch, moduli, force):
        light = np.maximum(force, 0.06)
        return np.array([made.predict_readings(light, one) * (1 + 0.01 * touch.variant) for one in moduli])

    patch.setattr(touches, "pressed", pressed)

    def told_by(known, block, doubts):
        chance = 1e3 * block[-1, 0] % 1
        return 0.1 + 0.2 * chance, 0.05 + 0.01 * (doubts == touches.Doubts.NONE), chance > 0.2

    patch.setattr(touches, "METHODS", {"all gauges": told_by, "S_d alone": told_by})
    exact = next(name for name, touch in touches.TOUCHES.items() if touch.exact)
    mixed = next(name for name, touch in touches.TOUCHES.items() if touch.others)
    rows = touches.feel(made, finger, touches=(exact, mixed), methods=("all gauges", "S_d alone"), seeds=range(7, 11),
                        progress=lambda *step: told.append(step))  # fmt: skip
    bounds = [touches.bound(made, 0.3, force, by_sd) for by_sd in (True, False)]
    kinds = [replace_words(touch) for touch in touches.TOUCHES.values()]
    return done, answers, asked, some, rows, told, touches.taken_as_exact(made).gauges[0].uncertainty, kinds, bounds


def replace_words(touch):
    """A touch without the functions that disturb it."""
    return [
        touch.at,
        touch.thickness_mm,
        touch.variant,
        str(touch.friction),
        len(touch.disturbances),
        len(touch.others),
    ]


def _telepresence(patch):
    asked = []

    class Record(SimpleNamespace):
        judged = slice(2, None)

        def felt(self, display):
            near = np.array([1.0, 1.1, np.nan, 1.3]) * self.size
            near = near * np.nan if self.late and display == "direct" and self.size > 1.7 else near
            return SimpleNamespace(wavelength_mm=near, error=0.01 * self.size, silent=0.2)

        def lag_ms(self, display):
            return (100.0 if display == "direct" else -3.0) * (1 + self.late) + self.size

        def change_ms(self, display):
            return self.lag_ms(display) + 10

        def stale_ms(self, display):
            return self.lag_ms(display) + 20

        def crossings(self, display):
            return np.array([[1.0, np.nan], [2.0, 3.0], [3.0, 4.0]])

    def run(scene, local=None, *more):
        links = [(link.one_way_ms, link.one_way_sd_ms, link.loss) for link in (scene.uplink, scene.downlink)]
        rule = local.rule(1.1, 20.0) if local else None
        hand = getattr(scene.motion, "peak_mm_s", None), getattr(scene.motion, "strokes_Hz", None)
        both = [getattr(scene.texture, side, scene.texture) for side in ("left", "right")]
        texture = [(one.wavelength_mm, one.amplitude) for one in both], getattr(scene.texture, "border_mm", None)
        asked.append([texture, *hand, scene.seconds, links, scene.noise_microstrain, scene.seed, rule])
        size = getattr(scene.texture, "wavelength_mm", 1.5)
        time = np.arange(4000) / 1000
        wave = np.sin(2 * np.pi * 40 * time) / (1 + 20 * (size - 1.4) ** 2)
        late = (
            float(scene.downlink.one_way_ms > 0) + 0.1 * float(scene.uplink.one_way_ms > 0) + 0.01 * scene.downlink.loss
        )
        return Record(
            time_s=time, local_um=wave, direct_um=1.5 * wave, size=size, late=late, late_ms=60 * late,
            wavelength_mm=np.where(time > 1, size * 1.01, np.nan), bytes_per_s={"local": 900.0, "direct": 9e3},
        )  # fmt: skip

    patch.setattr(telepresence, "run", run)
    patch.setattr(experiment, "run_loop", run)
    steps = []
    found = telepresence.experiments_2011(3, seconds=2.5, progress=lambda *step: steps.append(step))
    conditions = {number: one._replace(records=len(one.records)) for number, one in found.items()}
    beside = [telepresence.beside_each_other(), telepresence.beside_each_other(2.0, 3.0, strokes_Hz=1.0, seed=4)]
    beside.append(telepresence.beside_each_other(round_trip_ms=0.0, speed_mm_s=50.0))
    simulated = [*asked]
    patch.setattr(experiment, "_display", lambda: {})
    shown = [experiment.run(lambda text: steps.append(text), cause) for cause in (True, False)]
    return conditions, beside, steps, simulated, shown, asked[len(simulated) :], list(Parameters.__struct_fields__)


def _displays(patch):
    """The local model itself, for 2 s."""
    return experiment._display()


def _scenes(patch):
    """Rare scenes, those felt by a made-up finger, and every scene once."""
    asked = []

    def slide(finger, texture, motion, **how):
        asked.append({name: str(value) for name, value in how.items()} | {"texture": type(texture).__name__})
        low, high = texture.span
        at = np.clip(motion.position_mm[:, None] + np.linspace(-1, 1, 5), low, high)
        return SimpleNamespace(amplified=np.cos(at) + texture.recess(at))

    patch.setattr(scene_parts, "slide", slide)
    found = {}
    for name, wavelength in itertools.product(scenes.SCENES, (0.9, 2.1)):
        made = scenes.scene(name, wavelength, seed=4, seconds=0.4)
        columns = made.readings, made.wavelength_mm, made.velocity_mm_s, made.known_mm_s, made.frequency_Hz
        found[f"{name} {wavelength:g}"] = [
            np.sqrt(np.nanmean(one**2)) if np.isfinite(one).any() else None for one in columns
        ]
    return found, asked[:3]


def _wavelets(patch):
    """Which campaigns are drawn and how many runs are left out."""
    asked = []

    def campaign(*given):
        asked.append(repr(given))
        return [given[0] + k for k in range(3)]

    patch.setattr(wavelets, "RUNS", 1)
    patch.setattr(wavelets, "campaign", campaign)
    patch.setattr(wavelets, "accuracy", lambda runs, left, cause=True: 10.0 * runs[0] + left + 5 * cause)
    patch.setattr(wavelets, "_modulated", lambda assumed, sets=None: {"sets": len(sets or ())})
    patch.setattr(wavelets, "_contours", lambda rng, cause: {"contours": cause})
    patch.setattr(wavelets, "_formulas", lambda rng: {})
    patch.setattr(wavelets, "_phases", lambda cause: {"phases": cause})
    return [wavelets.run(lambda text: None, cause) for cause in (True, False)], asked


def _peers(patch):
    """Two libraries that settle, on a quarter and on the whole."""
    calls = itertools.count(1)

    class Library:
        def __init__(self, scene, threads):
            self.unknowns, self.size = 100 * threads, scene.size

        def press(self, penalty):
            seconds = 2.0 + (next(calls) * 7) % 5
            force = self.size * (1 - 0.3 / penalty)
            times = {"seconds": seconds, "seconds_assembly": 0.1 * seconds}
            return SimpleNamespace(force=force, displacement=penalty, systems=4, **times)

    def scene(model, indentation):
        size = 5.0 + len(model.mesh.mirrors)
        return SimpleNamespace(size=size, sd=lambda displacement: 1000 * indentation + displacement + size)

    class Model:
        def __init__(self, design, mesh):
            self.mesh = mesh

        def reduce(self):
            return made_up_finger.prepare()

    names, told = ("one", "other"), []
    peers = [SimpleNamespace(name=name, missing=None, prepare=Library) for name in names]
    peers.append(SimpleNamespace(name="absent", missing="absent is not installed"))
    patch.setattr(peer_runner, "FingerModel", Model)
    patch.setattr(peer_runner, "PeerScene", scene)
    patch.setattr(peer_runner, "press", made_up_finger.press)
    mirrored = replace(cube(2), mirrors=("x", "y"))
    rows = [*peer_runner.run_peers(Finger.default(), mirrored, peers=peers, progress=told.append)]
    rows += peer_runner.run_peers(Finger.default(), cube(2), peers=peers[:1], threads=3)
    return (
        rows,
        told,
        rows[0].to_json(),
        peer_runner.missing_peers(peers),
        peer_runner.run_peers(None, None, peers=peers[2:]),
    )


PARTS = {
    "measure": _measure,
    "drawn presses": _drawn_presses,
    "bench": _bench,
    "cost": _cost,
    "touches": _touches,
    "telepresence": _telepresence,
    "displays": _displays,
    "scenes": _scenes,
    "wavelets": _wavelets,
    "peers": _peers,
}


@pytest.mark.parametrize("part", PARTS)
def test_a_benchmark_gives_its_rows(part, monkeypatch):
    assert pinned.same(PARTS[part](monkeypatch), KEPT, part) == []


if __name__ == "__main__":
    pinned.update(PARTS, KEPT, sys.argv[1:])
