"""What the steps of a study hand to meshes, reductions, presses and calibrations, which are made up here."""

from concurrent.futures import Executor
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.core.errors import SolverError
from papilla.design import batch, geometry, influence, job, running
from papilla.design.batch import Batch, Done, Record, evaluate, version
from papilla.design.confirming import Confirmed
from papilla.design.geometry import geometry_map, with_sites
from papilla.design.parameters import made
from papilla.design.places import Places
from papilla.design.results import summary
from papilla.design.running import Pool
from papilla.design.scene import Scene
from papilla.design.study import read_study
from papilla.fem.finite.strain_tables import SIZE
from papilla.mesh.body import narrowest_mm
from papilla.model.finger import Finger, Slab
from papilla.model.specimen import STICK

FINGER = Finger.default()


# ---- Geometries


@pytest.mark.parametrize("based", [True, False])
def test_a_geometry_is_meshed_reduced_and_pressed_without_friction_and_stuck(monkeypatch, based):
    calls = SimpleNamespace(base=[], borrowed=[], meshed=[], family=[], pressed=[], stuck=0)

    def stuck():
        calls.stuck += 1

    def family(design, *, size_mm, mesh):
        calls.family.append((design, size_mm, mesh))
        return SimpleNamespace(tangential_source=stuck)

    monkeypatch.setattr(geometry, "measure_base", lambda *given: calls.base.append(given[:2]))
    monkeypatch.setattr(geometry, "borrow", lambda *given: calls.borrowed.append(given))
    monkeypatch.setattr(geometry, "build", lambda finger, size_mm: calls.meshed.append((finger, size_mm)) or "mesh")
    monkeypatch.setattr(geometry, "family", family)
    respond = lambda relatives, block, friction: calls.pressed.append((block, friction)) or friction  # noqa: E731
    monkeypatch.setattr(geometry, "response", respond)
    places = Places.of(FINGER)
    base = with_sites(FINGER, places)
    half = with_sites(made(FINGER, {"shape.scale": 0.5}), places)
    geometry.SPENT.clear()
    found = geometry_map.__wrapped__(half, places, base if based else None)
    assert (found.finger, found.places, found.ends) == (half, places, (0.0, STICK))
    assert (calls.base, calls.borrowed) == (([(base, 1)], [(half, base)]) if based else ([], []))
    ((meshed, size),) = calls.meshed
    assert size == pytest.approx(SIZE * narrowest_mm(half)) and calls.family == [(half, size, "mesh")]
    assert [gauge.angle_deg for gauge in meshed.gauges] == [-40.0, -20.0, 0.0, 20.0, 40.0]
    assert [gauge.name for gauge in meshed.gauges] == ["g0", "g1", "g2", "g3", "g4"] and meshed.shape == half.shape
    assert calls.pressed == [(half.bench.specimen(1.0), end) for end in (0.0, STICK)] and calls.stuck == 1
    assert set(geometry.SPENT) == {"geometry", "ratio"} and min(geometry.SPENT.values()) >= 0


def test_a_geometry_that_fails_is_the_reason_of_all_its_designs(monkeypatch):
    asked = []

    def fail(first, places, base):
        asked.append((first, base))
        raise SolverError("no mesh")

    monkeypatch.setattr(batch, "geometry_map", fail)
    half = made(FINGER, {"shape.scale": 0.5})
    places = Places.of(FINGER)
    done = evaluate(Batch((half, half, half), FINGER, places, Scene(), ("sigma_sd",), version()))
    assert done.records == (Record({}, "no mesh", half.sha256),) * 3 and done.version == version() and done.spent == {}
    assert asked == [(with_sites(half, places), with_sites(FINGER, places))] and 10 < done.memory_MB < 1e5
    alone = evaluate(Batch((half,), FINGER, places, Scene(), ("sigma_sd",), version()))
    assert alone.records == (Record({}, "no mesh", half.sha256),)


def test_the_depth_of_a_slab_is_a_length_too():
    slab = Slab(outer=(24.0, 20.0), interface=(21.0, 17.0), bone=(10.0, 6.0), depth=30.0)
    finger = replace(FINGER, shape=slab, ridges=None)
    assert made(finger, {"shape.scale": 0.5}).shape.depth == 15.0
    deep = made(finger, {"shape.scale": 0.5, "shape.depth_mm": 40.0, "shape.bone.z_mm": 2.0}).shape
    assert (deep.depth, deep.bone, deep.outer) == (40.0, (5.0, 2.0), (12.0, 10.0))


def test_influence_is_of_all_gauges_of_a_quarter(monkeypatch):
    """Adjoints of the gauges of a quarter, their work on moved tractions: each step is made up and says its input."""
    scene = Scene((0.2, 0.8), (0.1, 0.4))
    force, _ = scene.grid
    seen, patch = SimpleNamespace(ends=[], at=[]), object()
    finger = replace(FINGER, gauges=tuple(replace(one, membrane_gain=1.5, lever_mm=0.25) for one in FINGER.gauges))

    class Model:
        surfaces = {"interface": "interface"}

        def __init__(self, finger, mesh):
            self.finger, self.mesh = finger, mesh

        def reduce(self):
            return SimpleNamespace(patch=patch)

        def adjoints(self, functionals, shift, mixing):
            seen.model, seen.functionals, seen.mixing = self, functionals, mixing
            assert shift is None
            return "adjoints"

    def tractions(reduced, pressed, scene, friction, say):
        seen.ends.append(friction)
        assert reduced.patch is patch and pressed is finger
        return np.full((len(force), 3, 2), 1.0 if friction else 2.0)

    def moved(model, on, place):
        seen.at.append(place)
        assert model is seen.model and on is patch
        return SimpleNamespace(rows=lambda fields: np.full((len(seen.model.finger.gauges), 3, 2), 1e-6))

    def everywhere(quarter, finger, scene, read, say):
        seen.quarter = quarter
        return read(1.5, -2.0)

    monkeypatch.setattr(influence, "build", lambda finger, size_mm, progress: (finger, size_mm))
    monkeypatch.setattr(influence, "FingerModel", Model)
    monkeypatch.setattr(influence, "_tractions", tractions)
    monkeypatch.setattr(influence, "gauge_functionals", lambda finger, surface: (len(finger.gauges), surface))
    monkeypatch.setattr(influence, "gauge_weights", lambda finger: np.array([np.ones(3), 2 * np.ones(3)]))
    monkeypatch.setattr(influence, "on_each_side", lambda fields: ("sides", fields))
    monkeypatch.setattr(influence, "MovedContact", SimpleNamespace(at=moved))
    monkeypatch.setattr(influence, "_everywhere", everywhere)
    said = []
    found = influence.influence(finger, scene, said.append)
    angles, shares = 17, 9
    assert len(seen.quarter) == angles * shares * 2 and {one.direction_deg for one in seen.quarter} == {0.0, 90.0}
    assert {(one.membrane_gain, one.lever_mm) for one in seen.quarter} == {(1.5, 0.25)}
    assert min(one.angle_deg for one in seen.quarter) == 0.0 == min(one.y_mm for one in seen.quarter)
    meshed, size = seen.model.mesh
    assert size == pytest.approx(SIZE * narrowest_mm(FINGER)) and len(meshed.gauges) == 5
    assert [gauge.angle_deg for gauge in meshed.gauges] == [-40.0, -20.0, 0.0, 20.0, 40.0]
    assert seen.ends == [0.0, STICK] and seen.at == [(1.5, -2.0)]
    assert seen.functionals == (len(seen.quarter), "interface") and seen.mixing.shape == (3, 6)
    assert seen.mixing.toarray()[0].tolist() == [1, 0, 0, 2, 0, 0]
    # Six products of 1e-6 and the traction, in microstrain over the force
    assert found.shape == (2, len(force), len(seen.quarter))
    assert found[1, :, 0] == pytest.approx(6 / force) and found[0, :, 0] == pytest.approx(12 / force)
    assert said == ["reducing the finger", f"gauges at {len(seen.quarter)} places"]


# ---- Studies


def test_the_best_designs_and_the_own_finger_are_confirmed(study_file, tmp_path, monkeypatch, made_up):
    confirmed, said = [], []
    page = tmp_path / "pages"

    def confirm(name, design, processes, say):
        confirmed.append((name, design.finger.outer.modulus, processes))
        ones = np.ones((3, 5))
        return Confirmed(name, {"S_d": 0.2 * ones}, {"S_d": 0.25 * ones}, Scene())

    monkeypatch.setattr(job, "confirm", confirm)
    monkeypatch.setattr(job, "write_page", lambda path, outcome, say: None)
    few = ("designs = 12", "designs = 4")
    study = read_study(study_file(('name = "made up"', 'name = "made up"\nconfirm = 2'), few))
    found = job.run_study(study, page, workers=0, say=said.append)
    best = [found.results.free[row][0] for row in found.results.chosen]
    assert confirmed == [
        ("finger_1.toml", pytest.approx(best[0]), 1), ("finger_2.toml", pytest.approx(best[1]), 1),
        (FINGER.name, FINGER.outer.modulus, 1),
    ]  # fmt: skip
    assert said[-3:] == ["confirming design 1 by a calibration", "confirming design 2 by a calibration",
                         "calibrating the study's own finger"]  # fmt: skip
    told = summary(found)
    assert told["confirmed"][2] == {"finger": FINGER.name, "failed": "", "S_d": {"predicted": 0.2, "calibrated": 0.25}}
    assert [one["finger"] for one in told["confirmed"]] == ["finger_1.toml", "finger_2.toml", FINGER.name]


def test_the_strain_of_a_page_is_under_the_largest_force_on_the_hardest_specimen(monkeypatch):
    asked = []
    scene = Scene((0.2, 0.8), (0.1, 0.4))
    outcome = SimpleNamespace(study=SimpleNamespace(scene=scene))

    def shown(reduced, specimen, force, friction):
        asked.append((reduced, specimen, force, friction))
        return "press"

    monkeypatch.setattr(job.fem, "prepare", lambda finger, progress: ("reduced", finger))
    monkeypatch.setattr("papilla.view.shown", shown)
    monkeypatch.setattr("papilla.view.strain_pictures", lambda *given: asked.append(given) or "pictures")
    monkeypatch.setattr(job, "either", lambda *given: given)
    say = lambda line: None  # noqa: E731
    assert job._strain(FINGER, outcome, say) == ("pictures", f"Strain field of {FINGER.name}", "png")
    reduced, specimen = ("reduced", FINGER), FINGER.bench.specimen(0.4)
    assert asked == [(reduced, specimen, 0.8, 0.0), (FINGER, reduced, "press", specimen, say)]

    def fail(finger, progress):
        raise SolverError("no mesh")

    monkeypatch.setattr(job.fem, "prepare", fail)
    assert job._strain(FINGER, outcome, say) is None


# ---- Workers


class Counting(Executor):
    """Runs at once; counts what was submitted."""

    def __init__(self):
        self.sizes = []

    def submit(self, job, batch):
        from concurrent.futures import Future

        self.sizes.append(len(batch.fingers))
        done: Future = Future()
        values = dict.fromkeys(batch.asked, 1.0)
        records = tuple(Record(values, "ok", finger.sha256) for finger in batch.fingers)
        done.set_result(batch_done(records))
        return done


def batch_done(records):
    return Done(records, version(), {"scenes": 0.5}, 100.0 + len(records))


@pytest.mark.parametrize("workers, sizes", [(1, [50, 50, 20]), (3, [40, 40, 40])])
def test_designs_are_batched_for_all_workers_and_counted(study_file, tmp_path, workers, sizes):
    from papilla.design.sampling import groups
    from papilla.design.store import Store

    study = read_study(study_file(("designs = 12", "designs = 120")))
    store, tally, stages = Store(tmp_path / "s.sqlite"), running.Tally(), []
    executor = Counting()
    runner = running._Runner(study, store, tally, lambda *given: stages.append(given), Pool(executor, workers, "here"))
    runner.run(groups(study))
    assert executor.sizes == sizes and (tally.designs, tally.reused, tally.failed) == (120, 0, 0)
    assert tally.spent["scenes"] == 1.5 and tally.memory_MB == 100.0 + max(sizes)
    assert [done for _, done, _ in stages] == np.cumsum(sizes).tolist() and {one[2] for one in stages} == {120}
    assert stages[0][0].startswith(f"designs, {sizes[0]} of 120, about ") and stages[-1][0] == "designs, 120 of 120"
    assert [row[0] for row in store.rows(study)] == list(range(120))
    again = running._Runner(study, store, running.Tally(), lambda *given: stages.append(given), Pool(executor, 1, ""))
    again.run(groups(study))
    assert (again.tally.designs, again.tally.reused, executor.sizes) == (120, 120, sizes)
    assert stages[-1] == ("designs, 120 of 120", 120, 120) and again.number == 120
    store.close()
