"""The families of `papilla verify` on presses of a made-up finger give the cases that they gave.

The families themselves take minutes of finite elements and are slow tests; here it is what they compare, with which
bounds. `python tests/verify/test_pinned_verify.py [part ...]` (with tests/support on the path) writes the present
cases, for a change that moves them on purpose.
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import made_up_finger
import numpy as np
import pinned
import pytest
import scipy.sparse as sp

from papilla.core.errors import ContactRangeError
from papilla.core.units import gf_to_newton
from papilla.model.finger import Finger, Layer
from papilla.verify import (
    bodies,
    contact,
    finger,
    hard,
    identification,
    invariance,
    meshes,
    revolution,
    self_test,
    sliding,
)
from papilla.verify.case import Case
from papilla.verify.structured import cube

KEPT = Path(__file__).with_name("pinned_verify.json")


def press(reduced, specimen, **how):
    """A press with three gauges at hand, as many as `contact.hertz` has."""
    return made_up_finger.press(reduced, specimen, **how)


def pressed_by(reduced, force_gf, specimen=finger.BLOCK):
    """The nodal contact under a force in gf, which is refused from 150 gf on."""
    if force_gf > 150 or reduced.stiff > 1.2:
        raise ContactRangeError("too far")
    return press(reduced, specimen, force=float(gf_to_newton(force_gf)))


class Model:
    """In place of `FingerModel`; what is made is noted in `told`."""

    told: list = []

    def __init__(self, *given, **how):
        Model.told.append(repr([one for one in given if isinstance(one, Finger | Layer | float | int)]) + repr(how))
        self.finger = given[0] if isinstance(given[0], Finger) else Finger.default()
        self.mesh, self.given = given[1] if len(given) > 1 else None, given
        self.layers = {}

    def reduce(self, at=(0.0, 0.0)):
        own = made_up_finger.prepare(self.finger, at=at, variant=getattr(self.mesh, "variant", 0))
        softer = [one.modulus for one in self.given if isinstance(one, Layer)]
        return replace(
            own,
            stiff=own.stiff
            * (1 + 0.1 * sum(softer) + 0.03 * np.prod([o.nu for o in self.given if isinstance(o, Layer)])),
        )


def built(design, *, size_mm=1.4, variant=0, **_):
    """A mesh, of which only the number is known."""
    return SimpleNamespace(
        variant=variant,
        size_mm=size_mm,
        points=np.eye(3),
        tets=np.array([[0, 1, 2, 0]]),
        scaled=lambda f: f"mesh x {f:g}",
    )


def residuals(reduced, specimen, one):
    """Of a press, by its force."""
    return 1e-13 * one.force, 2e-13 * one.force, 3e-13 / one.force


def _bodies(patch, module):
    """Flat bodies without meshes."""
    Model.told = []
    for name in ("half_space", "bonded_layer", "coated", "FlatModel"):
        for owner in (module, bodies):
            if hasattr(owner, name):
                patch.setattr(owner, name, Model)
    patch.setattr(module, "press", press)


def _contact(patch):
    _bodies(patch, contact)
    places = made_up_finger.patch()
    patch.setattr(contact, "quadrature", lambda patch: (patch.xy, patch.mass, np.eye(9)))
    patch.setattr(bodies, "surface_pressure", lambda reduced, pressure: (places.xy + 0.1, pressure * places.mass))
    patch.setattr(bodies, "with_gap", lambda reduced, *radii: replace(reduced, stiff=sum(radii) / 100))

    def three(reduced, specimen, **how):
        found = press(reduced, specimen, **how)
        found.strain = found.strain[:3]
        return found

    patch.setattr(contact, "press", three)
    found = [*contact.hertz()]
    patch.setattr(contact, "press", press)
    found += [*contact.layers(), *contact.coat()]
    problems = []
    patch.setattr(contact, "weak_gap", lambda patch, ball: patch.gap)
    patch.setattr(contact, "PatchSurface", lambda patch, half_space: (patch, half_space))
    patch.setattr(made_up_finger.MadeUp, "half_space", "half-space", raising=False)

    @dataclass
    class Block:
        modulus: float
        thickness: float
        nu: float

        def traction_compliance(self, surface):
            return self.modulus * self.thickness * np.add.outer(np.arange(27.0), np.arange(27.0) ** 2) + self.nu

    class Path:
        def __init__(self, problem, friction):
            self.friction = friction
            problems.append((problem, friction))

        def at(self, indentation):
            return SimpleNamespace(force=5 * indentation, traction=np.ones((3, 9)) * (1 + min(self.friction, 1.0)))

    patch.setattr(contact, "Block", Block)
    patch.setattr(contact, "ContactProblem", lambda *given: given)
    patch.setattr(contact, "LoadingPath", Path)
    found += [*contact.friction()]

    return found, problems, Model.told


def _hard(patch):
    _bodies(patch, hard)
    patch.setattr(hard, "residual", lambda name, model: Case(name, "residual", len(model.given), 0.0))
    found = [*hard.contrast(), *hard._bonded_layer()]
    patch.setattr(hard, "Press", SimpleNamespace)
    patch.setattr(hard, "build", built)
    patch.setattr(hard, "FingerModel", Model)
    patch.setattr(hard, "default_reduced", made_up_finger.prepare)
    patch.setattr(hard, "pressed_by", pressed_by)
    patch.setattr(hard, "contact_residuals", residuals)
    doflocs = np.array([[0.0, 0, 20], [1, 0, 19], [0, 1, 20], [0, 0, 0]]).T
    model = SimpleNamespace(
        finger=Finger.default(), mesh=SimpleNamespace(points=doflocs.T),
        space=SimpleNamespace(displacement=SimpleNamespace(doflocs=doflocs)),
    )  # fmt: skip
    adjoints = {parity: np.moveaxis(np.arange(60.0).reshape(5, 4, 3), 0, 2) * -1e-6 for parity in ((0, 0), (1, 0))}
    patch.setattr(hard, "default_model", lambda size_mm=1.4: model)
    patch.setattr(hard.finger, "default_adjoints", lambda: adjoints)
    found += [*hard.loads(), *hard.places(), *hard._finger()]

    class Body(Model):
        space = SimpleNamespace(nodes=2)

        def factor(self):
            return np.arange(9) != 1, SimpleNamespace(matrix=self.given[1:])

    def factorise(matrix, pressures, engine):
        Model.told.append([repr(matrix), pressures, engine])
        return SimpleNamespace(solve=lambda loads: np.cumsum(loads, axis=0) * (1 + 1e-9 * (engine == "rslab")))

    patch.setattr(hard, "cylinder", lambda *given: Model.told.append(given))
    patch.setattr(bodies, "FlatModel", Body)
    patch.setattr(hard, "factorise", factorise)
    found += [*hard.engines()]
    return found, Model.told


def _invariance(patch):
    _bodies(patch, invariance)
    size = 9
    rng = np.random.default_rng(4)
    lower = sp.csr_matrix(np.tril(rng.normal(size=(12, 12)) + 30 * np.eye(12)))
    model = SimpleNamespace(
        finger=Finger.default(), mesh=built(None), surfaces={"skin": "skin"}, layers={},
        space=SimpleNamespace(nodes=3, matrix=lambda layers: lower),
        cell_displacements=lambda pressure: {invariance.SYMMETRIC: np.outer(pressure[:3], [1.0, 2.0, 3.0])},
    )  # fmt: skip
    sheets = rng.normal(size=(size, size))
    adjoints = {invariance.SYMMETRIC: rng.normal(size=(size, 5)), (1, 0): None, (0, 1): None}
    patch.setattr(invariance, "default_model", lambda size_mm: model)
    patch.setattr(invariance, "default_reduced", lambda size_mm: made_up_finger.prepare(size_mm=size_mm))
    patch.setattr(invariance, "default_adjoints", lambda size_mm: adjoints)
    patch.setattr(invariance.Frame, "at", lambda *given: given)
    loaded = SimpleNamespace(loads=lambda parity: sheets if parity == invariance.SYMMETRIC else None)
    asked = []
    patch.setattr(invariance, "build_patch", lambda *given: asked.append(given[3:]) or loaded)
    patch.setattr(invariance, "pressed_by", pressed_by)
    patch.setattr(invariance, "contact_residuals", residuals)
    patch.setattr(invariance, "FingerModel", Model)
    patch.setattr(invariance, "bonded_layer", lambda *given: asked.append(repr(given)) or flat)
    flat = SimpleNamespace(mesh=cube(2), finger=Finger.default(), reduce=lambda: made_up_finger.prepare(variant=1))

    def contact_press(reduced, block, given, friction):
        force, depth = given
        return press(reduced, block, force=force, indentation=depth, friction=friction)

    patch.setattr(invariance, "contact_press", contact_press)
    patch.setattr(invariance, "ContactProblem", lambda *given: given)
    patch.setattr(invariance, "first_touch", lambda problem: problem)
    steps = lambda problem, first, force: SimpleNamespace(iterations=3 + int(10 * force))  # noqa: E731
    patch.setattr(invariance, "contact_step", steps)
    patch.setattr(
        made_up_finger.MadeUp, "specimen_compliance", lambda self, specimen: 2.0 * self.compliance / specimen.modulus
    )
    return [*invariance.invariance()], asked, Model.told


def _meshes(patch):
    Model.told = []
    patch.setattr(meshes, "FingerModel", Model)
    patch.setattr(meshes, "build", built)
    patch.setattr(meshes, "press", press)
    patch.setattr(meshes, "pressed_by", pressed_by)
    patch.setattr(meshes, "mean_ratio", lambda points, tets: np.array([0.5, 1e-3, 0.3]))
    patch.setattr(meshes, "residual", lambda name, model: Case(name, "residual", 0.0, 0.0))
    patch.setattr(meshes, "default_reduced", made_up_finger.prepare)
    patch.setattr(meshes, "crushed", lambda cell, count: SimpleNamespace(points=count, tets=cell))
    patch.setattr(meshes, "mirrored", lambda mesh, axes: SimpleNamespace(variant=2))
    patch.setattr(meshes, "_refuses_flat_cell", lambda mesh: True)
    base = SimpleNamespace(finger=Finger.default(), mesh=SimpleNamespace(cell=lambda: "cell", mirrors="xy", variant=0))
    patch.setattr(meshes, "default_model", lambda: base)
    made = meshes.fingers()
    return [*meshes.scatter(), *meshes.moved(), *meshes.thin_layer(), *meshes.slivers()], made, Model.told


def _revolution(patch):
    patch.setattr(revolution, "FingerModel", Model)
    patch.setattr(revolution, "build", built)
    patch.setattr(revolution, "press", press)

    def finite(design, mesh, block, *, force, friction):
        return press(made_up_finger.prepare(design), block, force=force, friction=friction, fidelity="finite")

    made = []

    class Rings:
        def __init__(self, bodies, gauges):
            made.append(
                [repr(one) for one in bodies.materials] if hasattr(bodies, "materials") else type(bodies).__name__
            )

        def press(self, force):
            one = press(made_up_finger.prepare(), finger.BLOCK, force=force)
            one.values = np.array([one.strain * 1.01, one.strain])
            return one

    def path(bodies, gauges, force, friction):
        number = 2.0 if np.isinf(friction) else friction
        made.append([repr(bodies), len(gauges), force, number])
        return SimpleNamespace(at=lambda force: (0.5 + number, np.array([np.arange(5.0) * force, np.ones(5)])))

    patch.setattr(revolution, "press_finite", finite)
    patch.setattr(revolution, "Rings", Rings)
    patch.setattr(revolution, "press_path", path)
    patch.setattr(revolution, "Bodies", lambda shape, materials: [repr(one) for one in materials])
    return [*revolution.revolution()], made


def _sliding(patch):
    asked = []

    def prepare(design, *, size_mm):
        asked.append((size_mm, design.ridges is not None))
        x = np.linspace(-3, 3, 13)
        far = np.abs(np.subtract.outer(x, x))
        one = np.exp(-far) * (1 + size_mm**2)
        zero = np.zeros_like(one)
        return SimpleNamespace(
            x=x, z=10 - x**2 / 20, hats=0.5 * np.eye(13), compliance=np.block([[one, zero], [zero, 2 * one]])
        )

    def slide(design, texture, motion, **how):
        asked.append({name: value for name, value in how.items() if name != "section"} | {"texture": repr(texture)})
        way = np.sign(motion.position_mm[-1] - motion.position_mm[0])
        count = 2 * sliding.GIVEN.period_samples + 50
        t = np.arange(count)
        readings = np.column_stack([np.sin(0.1 * t), np.cos(0.1 * t), 0.5 * np.sin(0.1 * t + 1)])
        return SimpleNamespace(
            tangential_N=0.31 + 1e-3 * np.sin(t), force_N=np.ones(count), sliding=t > 20,
            readings=readings if way > 0 else readings[:, ::-1] * 1.01, energy_error=1e-4 * how["friction"],
        )  # fmt: skip

    patch.setattr(sliding, "prepare_section", prepare)
    patch.setattr(sliding, "slide", slide)
    real, laws = sliding.rub, []

    def rub(given, state):
        laws.append([given.compliance, given.rise, given.drift] if hasattr(given, "drift") else [vars(given)])
        return real(given, state)

    patch.setattr(sliding, "rub", rub)
    return [*sliding.sliding()], asked, laws


def _identification(patch):
    """A made-up problem of two bounded parameters and a linear one, whose best fit is known."""
    pytest.importorskip("iminuit")
    middle, sigma = np.array([0.3, -0.2, 1.0]), np.array([0.1, 0.2, 0.3])
    scale = np.vstack([np.diag(1 / sigma), [[3.0, 2.0, 0.0]], np.diag([0.2, 0.1, 0.1]), [[0.1, -0.1, 0]]])
    aim = scale @ middle
    problem = SimpleNamespace(
        free=["outer", "inner", "gain"], measured=np.zeros(4), linear=np.array([False, False, True]),
        bounds=(middle - [0.15, 3.0, 9], middle + [2.0, 3.0, 9]),
        residuals=lambda vector: scale @ vector - aim, jacobian=lambda vector: scale,
    )  # fmt: skip
    found = SimpleNamespace(problem=problem, vector=middle + 0.01 * sigma, sigma=sigma, names=problem.free)
    ends = {"outer": (0.9, 1.5), "inner": (0.7, 1.4)}

    def profile(own, name):
        low, high = ends[name]
        return SimpleNamespace(verdict="bounded", cut_off_by=(), lower=low, upper=high)

    patch.setattr(identification, "profile", profile)
    cases, asked = [*identification._against_minuit("made up", found)], []
    patch.setattr(identification, "family_of", lambda design, size_mm: (design.name, size_mm))
    patch.setattr(identification, "response", lambda family, block: (family, repr(block)))
    patch.setattr(identification, "_log", lambda smooth, rng, **presses: [smooth, rng.integers(1000), repr(presses)])
    patch.setattr(identification, "identify", lambda log, design, **how: [log, design.name, repr(how)])
    patch.setattr(identification, "_against_minuit", lambda *given: asked.append(given) or iter([]))
    assert [*identification.identification()] == []
    return cases, asked


def _flat_bodies(patch):
    """How flat bodies are meshed."""
    made = []
    patch.setattr(bodies, "FlatModel", lambda mesh, *given, **how: made.append((mesh, repr(given), repr(how))))
    patch.setattr(bodies, "cylinder", lambda radii, depths, interface, chords: (radii, depths, interface, chords))
    layer = Layer(1.0, 0.3)
    bodies.half_space(layer)
    bodies.half_space(layer, 4, sites=(0.5,))
    bodies.bonded_layer(layer, 1.3)
    bodies.bonded_layer(layer, 0.7, Layer(2.0, 0.4), (0.1, 0.2))
    bodies.coated(layer, Layer(2.0, 0.4), 0.8, 20.0, 30.0)
    bodies.coated(layer, Layer(2.0, 0.4), 0.8, 20.0, 30.0, ratio=1.7, chords=5)
    return made


def _default(patch):
    """The finger that families share."""
    asked = []
    patch.setattr(finger, "build", lambda design, size_mm: asked.append((design.name, size_mm)) or "mesh")

    class Made:
        def __init__(self, design, mesh):
            self.finger, self.mesh = design, mesh

        def gauge_adjoints(self):
            return {"made of": self.mesh}

        def reduce(self):
            return "reduced"

    patch.setattr(finger, "FingerModel", Made)
    for name in ("default_model", "default_adjoints", "default_reduced"):
        patch.setattr(finger, name, getattr(finger, name).__wrapped__)
    found = finger.default_adjoints(2.5), finger.default_reduced(), finger.default_reduced(3.0)
    pressed = []
    patch.setattr(finger, "contact_press", lambda *given: pressed.append(given[2:]))
    finger.pressed_by("reduced", 50.0)
    dense = np.array([[4.0, 0, 0, 0], [1, 5, 0, 0], [0.5, 0.2, 6, 0], [0, 0, 0, 3]])
    factor = SimpleNamespace(matrix=sp.csr_matrix(dense), solve=lambda loads: loads * 0.2)
    model = SimpleNamespace(factor=lambda: (np.ones(4, bool), factor), space=SimpleNamespace(nodes=1))
    return found, asked, pressed, finger.residual("made up", model), finger.random_loads(model, 2, 5)


def _self_test(patch):
    seen = []

    def prepare(design, size_mm):
        seen.append((design.name, size_mm, "PAPILLA_CACHE" in self_test.os.environ))
        return made_up_finger.prepare(design, size_mm=size_mm)

    patch.setenv(self_test.cache.ENVIRONMENT, "kept")
    patch.setattr(self_test, "exact_fields", lambda: iter([Case("first", "of nothing", 0.0, 1.0)]))
    patch.setattr(self_test.fem, "prepare", prepare)
    patch.setattr(self_test.fem, "press", press)
    cases = self_test.self_test()
    assert all(0 <= case.seconds < 60 for case in cases)
    return [replace(case, seconds=0.0) for case in cases], seen, self_test.os.environ[self_test.cache.ENVIRONMENT]


PARTS = {
    "contact": _contact,
    "hard": _hard,
    "invariance": _invariance,
    "meshes": _meshes,
    "revolution": _revolution,
    "sliding": _sliding,
    "identification": _identification,
    "flat bodies": _flat_bodies,
    "default finger": _default,
    "self-test": _self_test,
}


@pytest.mark.parametrize("part", PARTS)
def test_a_family_makes_its_cases(part, monkeypatch):
    assert pinned.same(PARTS[part](monkeypatch), KEPT, part) == []


if __name__ == "__main__":
    pinned.update(PARTS, KEPT, sys.argv[1:])
