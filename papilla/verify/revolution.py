"""Presses of a finger of revolution compared with the axisymmetric reference: linear presses, and the change by large
strain."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from papilla.core import settings
from papilla.core.units import gf_to_newton
from papilla.fem import FingerModel, Press, ReducedFinger, press, press_finite
from papilla.mesh import LayeredMesh, build
from papilla.model.finger import Dome, Finger
from papilla.model.specimen import STICK_WORD, THICKNESS_MM, Block, Friction, Sphere, friction_coefficient
from papilla.references.axisymmetric.bodies import FINE_SHAPE, Bodies, Rubber, Shape
from papilla.references.axisymmetric.presses import Rings, press_path
from papilla.verify.bodies import off
from papilla.verify.case import Case

RING_CASES = settings.parameters(__name__)
LINEAR_SETTINGS = RING_CASES.linear


def finger_of(shape: Shape) -> Finger:
    """The default finger in a form of revolution."""
    return replace(Finger.default(), shape=Dome(*((a, a, c) for a, c in (shape.outer, shape.interface, shape.bone))))


REVOLUTION_FINGER = finger_of(FINE_SHAPE)


def revolution() -> Iterator[Case]:
    """The default layers as a dome of revolution, on blocks from soft to rigid, and on balls."""
    mesh = build(REVOLUTION_FINGER)
    reduced = FingerModel(REVOLUTION_FINGER, mesh).reduce()
    yield from _linear(reduced)
    blocks: list[Block | Sphere] = [_block(modulus) for modulus in RING_CASES.pressed_MPa]
    balls: list[Block | Sphere] = [Sphere(modulus, radius) for modulus, radius in RING_CASES.balls]
    for specimen in blocks + balls:
        yield from _large_strain(
            mesh, specimen, press(reduced, specimen, force=RING_CASES.pressed_N, fidelity="contact")
        )


def _linear(reduced: ReducedFinger) -> Iterator[Case]:
    for modulus in RING_CASES.moduli_MPa:
        rings = Rings(_bodies(FINE_SHAPE, modulus, linear=True), REVOLUTION_FINGER.gauges)
        for force_gf in RING_CASES.forces_gf:
            force = gf_to_newton(force_gf)
            exact, pressed = rings.press(force), press(reduced, _block(modulus), force=force, fidelity="contact")
            errors = {
                "S_d": off(pressed.strain.std(), exact.values[0].std()),
                "gauges": float(np.abs(pressed.strain / exact.values[0] - 1).max()),
                "indentation": off(pressed.indentation, exact.indentation),
                "contact area": off(pressed.contact_area, exact.contact_area),
                "peak pressure": off(pressed.peak_pressure, exact.peak_pressure),
            }
            for name, error in errors.items():
                case = f"{modulus:g} MPa, {force_gf} gf, {name}"
                yield Case(case, f"{name} against axisymmetric rings of 0.02 mm", error, LINEAR_SETTINGS[name])


def _large_strain(mesh: LayeredMesh, specimen: Block | Sphere, linear: Press) -> Iterator[Case]:
    """Changes from a linear press without friction, in which the elements' own errors cancel, and so does what a ball's
    linear compliance differs from a half-space's."""
    before = _pressed(specimen, linear=True)
    frictions: tuple[tuple[Friction, str], ...] = ((0.0, "without friction"), (STICK_WORD, "stuck"))
    for friction, name in frictions:
        exact = _pressed(specimen, linear=False, friction=friction_coefficient(friction))
        pressed = press_finite(REVOLUTION_FINGER, mesh, specimen, force=RING_CASES.pressed_N, friction=friction)
        changes = {
            "S_d": (pressed.strain.std() / linear.strain.std(), exact[1] / before[1]),
            "indentation": (pressed.indentation / linear.indentation, exact[0] / before[0]),
        }
        curved = isinstance(specimen, Sphere)
        ball, stated = (f", {specimen.words}", 2 * pressed.specimen_error) if curved else ("", 0.0)
        for quantity, change in changes.items():
            measure = f"change of {quantity} from small strain against axisymmetric bodies, both at finite strain"
            case = f"large strain {name}, {specimen.modulus:g} MPa{ball}, {quantity}"
            yield Case(case, measure, off(*change), max(stated, RING_CASES.change[quantity]))


def _pressed(specimen: Block | Sphere, linear: bool, friction: float = 0.0) -> tuple[float, float]:
    """Indentation (mm) and S_d of the reference; a ball ends before its equator, on a cylinder that is bonded at the
    height of its centre."""
    shape = Shape()
    if isinstance(specimen, Sphere):
        shape = Shape(thickness=specimen.radius, width=0.9 * specimen.radius, ball=specimen.radius)
    bodies = _bodies(shape, specimen.modulus, linear)
    path = press_path(bodies, REVOLUTION_FINGER.gauges, RING_CASES.pressed_N, friction)
    indentation, values = path.at(RING_CASES.pressed_N)
    return float(indentation), float(values[0].std())


def _bodies(shape: Shape, modulus: float, linear: bool) -> Bodies:
    layers = [(layer.modulus, layer.nu) for layer in (REVOLUTION_FINGER.outer, REVOLUTION_FINGER.inner)]
    return Bodies(shape, [Rubber(E, nu, linear) for E, nu in (*layers, (modulus, _block(modulus).nu))])


def _block(modulus: float) -> Block:
    return Block(modulus, THICKNESS_MM)
