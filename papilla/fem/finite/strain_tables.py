"""Measures the change by large strain: presses at finite strain, and linear ones on the same mesh, over force and area.

The change is small (2 to 5 % of S_d) and smooth, so it needs neither a fine mesh nor many presses: 20 of them on a mesh
of 1.4 mm determine S_d of the default finger to 0.1 % (docs/adr/0032). Strains of a geometry depend on F / E_inner, E /
E_inner and r = E_outer / E_inner alone: there is one table for each ratio r without friction, and one with stick. For
each specimen the forces rise along one path and share factorised matrices.

`python benchmarks/shipped_tables.py` measures the default finger's geometry over five ratios of moduli and writes the
file that ships, with 36 presses a table on its reference mesh.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter

import numpy as np

from papilla.core.errors import ContactRangeError, InputError, SolverError
from papilla.core.progress import CountedStep, Progress, counted, silent
from papilla.core.workers import Start, workers
from papilla.fem.finite.newton import Linearisation
from papilla.fem.finite.pressing import LOAD_GROWTH, PressProblem, press_path, result
from papilla.fem.finite.touching import STICK_FRICTION
from papilla.fem.pressing.contact import contact_press
from papilla.fem.pressing.large_strain import LEAST_PRESSES, LargeStrain, at_ratio, keep, known
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.family import with_moduli
from papilla.fem.reduction.finger_model import FingerModel
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.mesh import LayeredMesh, build
from papilla.mesh.body import narrowest_mm, sharpest_mm
from papilla.model.finger import Finger
from papilla.model.specimen import STICK_WORD as STUCK
from papilla.model.specimen import Friction, friction_coefficient

RELATIVE_TABLE_FORCES = tuple(np.geomspace(0.00225, 0.09, 6).tolist())
"""F / (E_inner H^2), H being `narrowest_mm`; for the default finger: 0.03 to 1.2 N."""

BLOCK_MODULUS_RATIOS = (0.5, 1.5, 4.0, 10.0, 40.0, 1e4)
"""E / E_inner of the pressed blocks; for the default finger: 0.017 MPa to rigid."""

FEW_FORCES, FEW_MODULUS_RATIOS = (0, 1, 3, 4, 5), (0.8, 2.2, 10.0, 1e4)
"""The forces for a user's finger, by number, and E / E_inner. With four forces S_d of a rounder dome was 0.9 % off
between the largest two, where the tables of the default finger had shown 0.2 %. Softer blocks than the inner layer are
strained so much that a heavy press fails, and too few presses are left for the polynomial: with 0.5 for 0.8, S_d of a
slim dome was 1.2 % off instead of 0.6 %."""

RELATIVE_ELEMENT_SIZE = 0.07
"""Element size of its mesh at the contact, relative to `sharpest_mm`: 1.4 mm for the default finger. A contact on a
sharp apex is narrower: on a tall dome S_d of heavy presses that stick was 0.6 % too small with elements of 0.07 of the
half breadth, and 0.1 % with 0.05."""

SPANNING_LAYER_RATIOS = (1.0, 4.0, 16.0)
"""Ratios for a user's finger whose moduli are not known yet; between the three tables the ratio is interpolated."""

FINITE_PRESS_TOLERANCE = 1e-4
"""Relative residual of these presses at finite strain: S_d is then accurate to 1e-5."""

_REFUSED: dict[tuple[str, float, bool], str] = {}
"""Reasons why tables cannot be made, so that they are not tried again at each press."""


@dataclass(frozen=True, eq=False)
class PressedFinger:
    """A finger on its mesh that blocks of its bench press at the apex; what all these presses share is made once."""

    finger: Finger
    mesh: LayeredMesh

    @cached_property
    def reduced(self) -> ReducedFinger:
        """The linear finger on the same mesh."""
        return FingerModel(self.finger, self.mesh).reduce()

    def presses(
        self,
        forces: Sequence[float],
        moduli: Sequence[float],
        friction: Friction,
        progress: Progress = silent,
        growth: float = LOAD_GROWTH,
    ) -> Iterator[Press]:
        """Presses at finite strain by rising forces (N) on blocks of some moduli (MPa), as far as the model allows.

        The blocks themselves stay linear: `with_specimen_strain(press, pressed.skin)` adds what they change. `growth`
        is that of the load between steps, with friction. Each force starts from the one before, so this is faster than
        as many `press_finite`.
        """
        coefficient = min(STICK_FRICTION, friction_coefficient(friction))
        linearisation: Linearisation | None = self._rubbing if coefficient else self._smooth
        for count, modulus in enumerate(moduli):
            equilibrium = None
            touching = replace(self._scene.touching, specimen=self.finger.bench.specimen(modulus), friction=coefficient)
            scene = replace(self._scene, touching=touching)
            for number, force in enumerate(forces, 1):
                began, share = perf_counter(), force / len(scene.touching.patch.images)
                try:
                    equilibrium, *_, linearisation = press_path(
                        scene,
                        share,
                        None,
                        start=equilibrium,
                        linearisation=linearisation,
                        tolerance=FINITE_PRESS_TOLERANCE,
                        growth=growth,
                    )
                    press = result(scene, equilibrium, force, "finite", began)
                except (ContactRangeError, SolverError):
                    break
                finally:
                    progress(
                        CountedStep("presses at finite strain", count * len(forces) + number, len(forces) * len(moduli))
                    )
                yield press

    @property
    def skin(self) -> tuple[float, float]:
        """Thickness (mm) and modulus (MPa) of the outer layer at the apex."""
        return self._scene.skin

    @cached_property
    def _scene(self) -> PressProblem:
        specimen = self.finger.bench.specimen(self.finger.inner.modulus)
        return PressProblem.of(self.finger, self.mesh, specimen, {}, (0.0, 0.0), STICK_FRICTION)

    @cached_property
    def _rubbing(self) -> Linearisation:
        """The factorised tangent at rest, with friction."""
        return Linearisation.at(self._scene.body, self._scene.touching, self._scene.at_rest)

    @cached_property
    def _smooth(self) -> Linearisation:
        """The same without friction; a part of it, if that is known."""
        if "_rubbing" in self.__dict__:
            return self._rubbing.of_pressure(len(self._scene.touching.patch.mass))
        smooth = replace(self._scene, touching=replace(self._scene.touching, friction=0.0))
        return Linearisation.at(smooth.body, smooth.touching, smooth.at_rest)


def measure_large_strain(
    pressed: PressedFinger,
    *,
    friction: Friction = 0.0,
    forces: Sequence[float] = RELATIVE_TABLE_FORCES,
    moduli: Sequence[float] = BLOCK_MODULUS_RATIOS,
    growth: float = LOAD_GROWTH,
    progress: Progress = silent,
) -> LargeStrain:
    """The table of a finger on its mesh, pressed at the apex; `progress` counts the presses.

    forces, moduli : F / (E_inner H^2) and E / E_inner, H being `narrowest_mm`.
    friction : 0, or "stick" for presses in which nothing slips. Presses outside the range of either model are left out.
    growth : of the load between steps, with friction.
    Raises `InputError` if too few remain or if there are not two layers below the apex, and what reducing and
    factorising raise.
    """
    finger, reduced = pressed.finger, pressed.reduced
    if len(reduced.layers) < 2:
        raise InputError("the finger has no two layers below the apex")
    inner, coefficient = finger.inner.modulus, friction_coefficient(friction)
    rows: list[tuple] = []
    loads = [force * inner * narrowest_mm(finger) ** 2 for force in forces]
    for finite in pressed.presses(loads, [modulus * inner for modulus in moduli], friction, progress, growth):
        touched = finger.bench.specimen(finite.modulus)
        try:
            # The nodal contact without the ellipse's correction, because presses at finite strain have the same nodal
            # error
            linear = contact_press(reduced, touched, (finite.force, None), coefficient)
        except (ContactRangeError, SolverError):
            continue
        scaled = finite.force / inner, finite.modulus / inner
        rows.append((*scaled, _values(linear, inner), _values(finite, inner)))
    if len(rows) < LEAST_PRESSES:
        raise InputError(f"only {len(rows)} of {len(forces) * len(moduli)} presses at finite strain can be made")
    force, modulus, small, large = map(np.array, zip(*rows, strict=True))
    return LargeStrain(finger.outer.modulus / inner, force, modulus, small, large, coefficient)


def ensure_large_strain(
    finger: Finger,
    ends: Iterable[bool] = (False, True),
    *,
    ratios: Iterable[float] | None = None,
    progress: Progress = silent,
) -> str:
    """Make the missing tables of a finger now; arguments and result as for `begin_large_strain`."""
    with workers(1, progress) as start:
        return begin_large_strain(finger, ends, start, ratios=ratios, progress=progress)()


def begin_large_strain(
    finger: Finger,
    ends: Iterable[bool],
    start: Start,
    *,
    ratios: Iterable[float] | None = None,
    progress: Progress = silent,
) -> Callable[[], str]:
    """Start to make the missing tables of a finger; the returned function waits for them and keeps them in the cache.

    Parameters
    ----------
    ends : False for tables without friction, True for stuck ones.
    start : from `papilla.core.workers.workers`.
    ratios : E_outer / E_inner of the tables; None is the finger's own ratio, unless the known tables cover it.

    The returned function gives the reason if a finger has no tables, else an empty text.
    """
    key, layer_ratio = finger.strain_sha256, finger.outer.modulus / finger.inner.modulus
    tables = known(key)
    # The finger's own ratio may lie between known tables: then nothing is missing.
    wanted = [(ratio, stuck) for ratio in ((layer_ratio,) if ratios is None else ratios) for stuck in ends]
    missing = [(ratio, stuck) for ratio, stuck in wanted if not at_ratio(tables, ratio, stuck)]
    refused = next((_REFUSED[key, *table_key] for table_key in missing if (key, *table_key) in _REFUSED), "")
    if not missing or refused:
        return lambda: refused
    # Of one ratio in one process, because they share mesh, factor and linear finger; stuck first, whose factor is all
    ends_of_ratio = {ratio: sorted({stuck for of, stuck in missing if of == ratio})[::-1] for ratio, _ in missing}
    begun = [start(measure_few, finger, ratio, stuck) for ratio, stuck in ends_of_ratio.items()]

    def wait() -> str:
        """Keep the tables when they are done; returns why there are none, or an empty text."""
        try:
            for number, made in enumerate(begun, 1):
                keep(key, [LargeStrain.from_json(table) for table in made()])
                progress(CountedStep(f"large strain: {number} of {len(begun)} ratios", number, len(begun)))
        except (InputError, SolverError) as error:
            _REFUSED.update({(key, *table_key): f"large strain is not included: {error}" for table_key in missing})
            return _REFUSED[key, *missing[0]]
        return ""

    return wait


def measure_few(finger: Finger, ratio: float, ends: Sequence[bool], progress: Progress) -> list[dict]:
    """The tables (`LargeStrain.to_json`), stuck (True) and without friction, of a finger with its moduli at a ratio,
    from few presses on a coarse mesh."""
    mesh = build(finger, RELATIVE_ELEMENT_SIZE * sharpest_mm(finger))
    if abs(ratio * finger.inner.modulus / finger.outer.modulus - 1) > 1e-12:
        finger = with_moduli(finger, ratio * finger.inner.modulus, finger.inner.modulus)
    forces, pressed, made = [RELATIVE_TABLE_FORCES[k] for k in FEW_FORCES], PressedFinger(finger, mesh), []
    for stuck in ends:
        words = "stuck" if stuck else "without friction"
        steps = counted(progress, f"large strain, layers 1 : {ratio:.3g}, {words}: press")
        friction: Friction = STUCK if stuck else 0.0
        table = measure_large_strain(
            pressed, friction=friction, forces=forces, moduli=FEW_MODULUS_RATIOS, progress=steps
        )
        made.append(table.to_json())
    return made


def _values(press: Press, inner: float) -> np.ndarray:
    return np.concatenate([[press.indentation, press.contact_area, press.peak_pressure / inner], press.values.ravel()])
