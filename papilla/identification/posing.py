"""States the problem of a fit, from a log of presses and a design: does the log fit the finger, which parameters are
free, and which responses are needed?"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from papilla.core.errors import InputError
from papilla.core.progress import Progress, silent
from papilla.core.workers import workers
from papilla.fem.finite.strain_tables import SPANNING_LAYER_RATIOS, begin_large_strain
from papilla.fem.pressing.large_strain import ends_of
from papilla.fem.pressing.off_apex import MoveLimits, off_apex_change
from papilla.fem.pressing.response import response
from papilla.fem.reduction.family import FingerFamily, family, with_moduli
from papilla.identification.noise import PressNoise
from papilla.identification.parameters import checked_values, expanded, kind, linear_last, names_of, start_of
from papilla.identification.presses import Known, PressedShape, needs_places, refuse_far
from papilla.identification.problem import PRIOR_MEANS, Problem
from papilla.logs import PressLog
from papilla.mesh import default_size_mm
from papilla.model.finger import Bench, Finger
from papilla.model.specimen import THICKNESS_MM, Block, Friction, Specimen, friction_coefficient, friction_words

POSED_COARSENESS = 1 / 0.7
"""Element size at the contact for identifications, over `default_size_mm`: S_d differs by 0.6 % at most from that on
elements of half the size."""

MOST_UNKNOWN = 0.3
"""Relative standard deviation of a specimen's modulus above which the log is refused."""

THICKNESS_FACTOR = 1.2
"""Factor between the thicknesses for which responses are made, if the thickness is free."""

SOFT_MPA, RUBBER_MPA = 5.0, 100.0
"""If all specimens are harder than the first value, or one is harder than the second, the moduli are not in MPa."""

LEAST_MICROSTRAIN = 0.5
"""Readings that are all smaller than this are strains, not microstrain."""

EITHER_WAY = 2.0
"""Factor by which the inner modulus may differ from the design's when a press is checked against the range of the
model."""


def problem_of(
    log: PressLog,
    finger: Finger,
    free: Sequence[str] = (),
    fix: Mapping[str, float] | None = None,
    specimen: Specimen | None = None,
    noise: PressNoise | None = None,
    friction: Friction | None = None,
    size_mm: float | None = None,
    progress: Progress = silent,
) -> Problem:
    """The problem that `identify` solves, not yet weighted; for the arguments see there."""
    refuse(log, finger)
    fixed = checked_values(fix or {}, finger)
    touched = finger.bench.specimen(1.0) if specimen is None else specimen
    # Several specimens: the one with the most presses defines the parameter thickness.
    if log.on is not None:
        touched = log.specimens[int(np.bincount(log.on).argmax())]
    if isinstance(touched, Block) and "thickness_mm" in fixed:
        touched = replace(touched, thickness=fixed["thickness_mm"])
    specimens = specimens_of(log)
    wanted = linear_last((*free_parameters(log, finger, free, fixed), *specimens))
    friction = finger.bench.friction if friction is None else friction
    shapes = shapes_of(log, touched, finger, wanted, fixed, friction, size_mm, progress)
    opened = {"stick_share": PRIOR_MEANS["stick_share"]} if any(shape.friction_open for shape in shapes) else {}
    wanted = linear_last((*wanted, *opened))
    start = start_of(finger, touched.thickness if isinstance(touched, Block) else THICKNESS_MM) | fixed | opened
    start |= {name: float(log.modulus_MPa[specimen_modulus.rows[0]]) for name, specimen_modulus in specimens.items()}
    problem = Problem(log, finger, shapes, start, wanted, noise or PressNoise(), specimens=specimens)
    refuse_beyond(problem)
    return problem


def specimens_of(log: PressLog) -> dict[str, Known]:
    """The specimens whose log states an uncertainty of their modulus, as parameters by name."""
    if log.modulus_sigma_MPa is None:
        return {}
    on = np.zeros(len(log)) if log.on is None else log.on
    conditions, which = np.unique(np.column_stack([log.modulus_MPa, on]), axis=0, return_inverse=True)
    by_name: dict[str, Known] = {}
    for number, (modulus, _) in enumerate(conditions.tolist()):
        alike = int((conditions[: number + 1, 0] == modulus).sum())
        rows = np.flatnonzero(which == number)
        sigma = log.modulus_sigma_MPa[rows]
        if np.ptp(sigma) > 0:
            raise InputError(
                f"modulus_sigma_MPa of the specimen of {modulus:g} MPa must be one number, got {sigma.min():g} to "
                f"{sigma.max():g}: it is what is not known of the specimen, the same in all presses on it"
            )
        if sigma[0] > MOST_UNKNOWN * modulus:
            raise InputError(
                f"modulus_sigma_MPa {sigma[0]:g} of a specimen of {modulus:g} MPa says that it is not known at all"
            )
        if sigma[0] > 0:
            name = f"specimen_modulus.{modulus:g}{f'#{alike}' if alike > 1 else ''}"
            by_name[name] = Known(float(sigma[0]) / modulus, rows)
    return by_name


def moved_by(values: Mapping[str, float], gauge: str) -> tuple[float, float]:
    """Displacement (mm) of a gauge from its designed place, along and across the interface, by the parameter values."""
    return values.get("row_along_mm", 0.0) + values.get(f"place_mm.{gauge}", 0.0), values.get("row_across_mm", 0.0)


def family_of(
    finger: Finger, *, size_mm: float | None = None, variant: int = 0, progress: Progress = silent
) -> FingerFamily:
    """The family of a finger's geometry. It is the same for all moduli, gains and levers, so the geometry is reduced
    once."""
    gauges = tuple(replace(gauge, membrane_gain=1.0, lever_mm=0.0) for gauge in finger.gauges)
    plain = replace(finger, name="geometry", gauges=gauges, bench=Bench(), ridges=None, identified=None)
    if finger.outer.material is None and finger.inner.material is None:
        plain = with_moduli(plain, 1.0, 1.0)
    return family(
        plain, size_mm=size_mm or POSED_COARSENESS * default_size_mm(plain), variant=variant, progress=progress
    )


def ensure_physics(
    finger: Finger, friction: Friction | None, *, processes: int = 1, progress: Progress = silent
) -> None:
    """Make the tables of large strain that presses of a finger need at any moduli; with and without friction, if the
    friction is not stated."""
    ends = (False, True) if friction is None else ends_of(friction_coefficient(friction))
    with workers(processes, progress) as start:
        begin_large_strain(finger, ends, start, ratios=SPANNING_LAYER_RATIOS, progress=progress)()


def free_parameters(log: PressLog, finger: Finger, free: Sequence[str], fixed: Mapping[str, float]) -> tuple[str, ...]:
    """The parameters that a fit varies, in the order of the table. Raises `InputError` for parameters that the presses
    cannot determine."""
    of_gauges, common = ("gain", "lever_mm", "zero_microstrain"), ("common_gain", "common_lever_mm")
    usual = ["outer_modulus_MPa", "inner_modulus_MPa", *(of_gauges if log.stated_sd is None else common)]
    asked = expanded(free, finger)
    gains_fixed = {"gain", "lever_mm"} <= {kind(name) for name in fixed}
    for name in asked:
        if log.stated_sd is not None and kind(name) in (*of_gauges, "place_mm"):
            raise InputError(f"{name} needs readings, and the log has S_d alone, which determines common_gain")
        if log.stated_sd is None and kind(name) in common and not gains_fixed:
            raise InputError(f"{name} needs gain and lever_mm to be fixed: otherwise it is part of each of them")
    if log.indentation_mm is not None:
        usual.append("touch_down_mm")
    elif "touch_down_mm" in asked:
        raise InputError("touch_down_mm needs indentations, and the log has no indentation_mm")
    both = [name for name in asked if name in fixed]
    if both:
        raise InputError(f"{both[0]} cannot be both free and fixed")
    wanted = {*expanded(usual, finger), *asked} - {*fixed}
    return linear_last(name for name in names_of(finger) if name in wanted)


def shapes_of(
    log: PressLog,
    touched: Specimen,
    finger: Finger,
    free: tuple[str, ...],
    fixed: Mapping[str, float],
    friction: Friction | None,
    size_mm: float | None,
    progress: Progress,
) -> tuple[PressedShape, ...]:
    """The shapes of specimens in a log, each with the responses of a finger's family to it; with and without friction,
    if the friction is not stated and large strain is known for both.

    touched : what was pressed, if the log does not say it.
    """
    if "thickness_mm" in free and not isinstance(touched, Block):
        raise InputError(f"thickness_mm is the thickness of a block, but the presses are on a {touched.words}")
    if "thickness_mm" in free and len(log.specimens) > 1:
        raise InputError(
            f"thickness_mm is the thickness of one block, but the presses are on {len(log.specimens)} specimens"
        )
    relatives = family_of(finger, size_mm=size_mm, progress=progress)
    if any(pressed.curvature == (0.0, 0.0) for pressed in log.specimens or (touched,)):
        ensure_physics(finger, friction, progress=progress)
    moving = needs_places(log, free, fixed)
    if moving:
        refuse_far(log, MoveLimits.of(relatives), free)
    shapes = []
    for number, specimen in enumerate(log.specimens or (touched,)):
        variants: tuple[Specimen, ...] = (specimen,)
        thicknesses: tuple[float, ...] = ()
        if isinstance(specimen, Block) and "thickness_mm" in free:
            thicknesses = tuple(touched.thickness * THICKNESS_FACTOR**k for k in (-1, 0, 1))  # type: ignore[attr-defined]
            variants = tuple(replace(specimen, thickness=variant) for variant in thicknesses)
        if any(kind(name).startswith("tilt") for name in free) and specimen.curvature != (0.0, 0.0):
            raise InputError(
                f"a tilt moves the contact with a {specimen.words} by what it turns about: only flat ones tell it"
            )
        responses = tuple(response(relatives, variant, friction=friction, progress=progress) for variant in variants)
        # Friction not stated: stick and no friction, between which a share is fitted.
        if friction is None and responses[0].friction:
            responses += tuple(response(relatives, variant, friction=0.0, progress=progress) for variant in variants)
        rows = np.arange(len(log)) if log.on is None else np.flatnonzero(log.on == number)
        shapes.append(PressedShape(rows, specimen, responses, thicknesses))
    ordered = tuple(sorted(shapes, key=lambda shape: -len(shape.rows)))
    return with_moves(ordered, relatives, progress) if moving else ordered


def with_moves(
    shapes: tuple[PressedShape, ...], relatives: FingerFamily, progress: Progress = silent
) -> tuple[PressedShape, ...]:
    """The shapes with the changes by contacts beside the apex and by moved gauges, for the presses on each of them."""
    moved_shapes = []
    for shape in shapes:
        friction = friction_words(shape.responses[0].friction)
        moved = shape.off_apex or off_apex_change(relatives, shape.specimen, friction, progress=progress)
        moved_shapes.append(replace(shape, off_apex=moved))
    return tuple(moved_shapes)


def refuse(log: PressLog, finger: Finger) -> None:
    """Raise `InputError` for a log of another finger, or in other units."""
    names = tuple(gauge.name for gauge in finger.gauges)
    if log.stated_sd is not None:
        if len(names) < 2:
            raise InputError(f"the finger {finger.name!r} has one gauge, and S_d is that of several")
    elif len(log.gauge_names) != len(names):
        raise InputError(
            f"the log has {len(log.gauge_names)} gauges ({', '.join(log.gauge_names)}), "
            f"the finger {finger.name!r} has {len(names)}"
        )
    elif log.gauge_names != names:
        raise InputError(
            f"the log has the gauges {', '.join(log.gauge_names)}, the finger {finger.name!r} {', '.join(names)}"
        )
    if not len(log):
        raise InputError("the log has no press: at least one is needed")
    softest, hardest = log.modulus_MPa.min(), log.modulus_MPa.max()
    if softest > SOFT_MPA or hardest > RUBBER_MPA:
        raise InputError(
            f"modulus_MPa goes from {softest:g} to {hardest:g} MPa, which is no softness: is it in kPa? "
            f"Specimens are of {RUBBER_MPA:g} MPa at most, the softest below {SOFT_MPA:g}{_sizes(log)}"
        )
    largest = float(np.abs(log.readings if log.stated_sd is None else log.stated_sd).max())
    if largest < LEAST_MICROSTRAIN:
        what = "all gauges read 0" if largest == 0 else f"no gauge reads more than {largest:.3g}"
        raise InputError(f"{what}: readings are expected in microstrain, are these strains?{_sizes(log)}")


def refuse_beyond(problem: Problem) -> None:
    """Raise `InputError` for a press that no finger like this one could withstand: its force is probably in another
    unit."""
    log, values = problem.log, problem.held
    inside = np.zeros(len(log), bool)
    for factor in (1 / EITHER_WAY, 1.0, EITHER_WAY):
        moduli = factor * values["outer_modulus_MPa"], factor * values["inner_modulus_MPa"]
        for shape in problem.shapes:
            loads = log.force_N[shape.rows], log.modulus_MPa[shape.rows]
            inside[shape.rows] |= shape.responses[0].inside(*loads, *moduli)
    if not inside.all():
        press = int(np.argmin(inside))
        raise InputError(
            f"press {press + 1}, {log.force_N[press]:g} N on {log.modulus_MPa[press]:g} MPa, is beyond the model of a "
            f"finger of {values['inner_modulus_MPa']:g} MPa inside: is force_N in N (1 gf is 0.0098 N), modulus_MPa in "
            f"MPa? Leave it out otherwise{_sizes(log)}"
        )


def _sizes(log: PressLog) -> str:
    """The notes on units, with maps that correct them, as the end of a sentence."""
    return "".join(f"; {note}" for note in log.sizes)
