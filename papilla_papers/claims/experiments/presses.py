"""2006 II, IV and 2011 Okamoto 3.2: effects of a press on the layered finger, and equations (6)-(8)."""

import dataclasses
import math

import numpy as np
from scipy.optimize import minimize_scalar

from papilla import fem, mesh
from papilla.core.units import KPA_PER_MPA, PER_CENT, gf_to_newton, newton_to_gf
from papilla.model.finger import Finger
from papilla.model.specimen import Block, HalfSpace
from papilla.references import printed_area, shared_approach
from papilla_papers.claims.claim import Experiment, gathered
from papilla_papers.claims.scenes import by_factors, scene
from papilla_papers.claims.signals import listed

PRESS_SCENE = scene("presses")
RIGID_MPA: float = PRESS_SCENE.rigid_MPa
OFFSET_MM: float = PRESS_SCENE.offset_mm
PRINTED_SETTINGS = PRESS_SCENE.printed
_FORCES_N = (*map(gf_to_newton, PRINTED_SETTINGS.forces_gf), PRINTED_SETTINGS.force_N)
PRINTED_N = dict(zip(PRINTED_SETTINGS.depths_mm, _FORCES_N, strict=True))
AREA_MODULI_MPA = tuple(by_factors(PRESS_SCENE.moduli.modulus_MPa).tolist())
SPECIMEN_MODULI_MPA: tuple[float, float, float] = PRESS_SCENE.specimens_MPa
SOFT_MODULUS_MPA, MIDDLE_MODULUS_MPA, HARD_MODULUS_MPA = SPECIMEN_MODULI_MPA
DEPTH_NAMES = tuple(f"{round(PER_CENT * depth):03d}" for depth in PRINTED_N)
"""Names of the depths in findings."""


def run(tell, cause: bool = True) -> dict:
    """What a press does to the layered finger: readings, stress, contact area, and how the approach is shared.

    The default finger is pressed on its reference mesh: on blocks of 0.02-20 MPa by 0.49 N, on the three published
    specimens by 60 gf, and on a rigid flat to the printed depths, with a touch-down offset and without. Displacements
    are recovered in the whole mesh at 1 and 2.5 mm, in the layered finger and in a homogeneous one of the mean modulus.
    Equations (6)-(8) are compared with Hertz's contact and with half-spaces of 0.2 and 2 MPa at 0.1 N.
    """
    finger = Finger.default()
    tell("the finger")
    reduced = fem.prepare(finger)
    force = gf_to_newton(PRESS_SCENE.force_gf)
    moduli = SPECIMEN_MODULI_MPA
    at_60 = {E: fem.press(reduced, _block(E if cause else MIDDLE_MODULUS_MPA), force=force) for E in moduli}
    tell("presses over the modulus, the field inside, with layers and without")
    return gathered(
        lambda: _over_moduli(reduced, cause),
        lambda: _three(at_60),
        lambda: _depths(reduced),
        lambda: _equations(reduced, cause),
        lambda: _field(finger, reduced, cause),
        _second_design,
    )


def _block(modulus: float) -> Block:
    return Block(modulus, PRESS_SCENE.thickness_mm)


def _over_moduli(reduced, cause: bool) -> dict:
    """Contact area, the finger's part of the indentation and S_d over the modulus."""
    setup = PRESS_SCENE.moduli
    bodies = [_block(modulus if cause else MIDDLE_MODULUS_MPA) for modulus in AREA_MODULI_MPA]
    table = [fem.press(reduced, body, force=setup.force_N) for body in bodies]
    some = slice(None, None, setup.every)
    area = np.array([press.contact_area for press in table])
    gives = np.array([press.finger_indentation for press in table])
    sd = np.array([press.sd for press in table])
    return {
        "sd": listed(sd[some], ".0f"),
        "moduli": listed(AREA_MODULI_MPA[some], ".2g"),
        "area": listed(area[some], ".0f"),
        "area_falls": float(np.mean(np.diff(area / gives) < -setup.falls)),
        "area_first": area[0] / gives[0],
        "area_last": area[-1] / gives[-1],
        "follows": float(np.corrcoef(sd, gives / area)[0, 1]) if np.ptp(sd) > setup.rises * sd.max() else 0.0,
    }


def _three(at_60) -> dict:
    """The three published specimens under 60 gf."""
    return {
        "gauges": float(len(at_60[MIDDLE_MODULUS_MPA].reading)),
        "readings": listed(PER_CENT * at_60[MIDDLE_MODULUS_MPA].strain, "+.2f"),
        "softness_shows": at_60[HARD_MODULUS_MPA].sd / at_60[SOFT_MODULUS_MPA].sd,
        "gain_low": at_60[MIDDLE_MODULUS_MPA].sd / at_60[SOFT_MODULUS_MPA].sd - 1,
        "gain_high": at_60[HARD_MODULUS_MPA].sd / at_60[MIDDLE_MODULUS_MPA].sd - 1,
        "peak_ratio": at_60[HARD_MODULUS_MPA].peak_pressure / at_60[SOFT_MODULUS_MPA].peak_pressure,
    }


def _depths(reduced) -> dict:
    """Force (gf, N) at the printed depths on a rigid flat, with and without the offset, and with the offset that
    follows from the other two points."""
    values: dict[str, float] = {}

    def force(depth: float) -> float:
        return float(fem.press(reduced, HalfSpace(RIGID_MPA), indentation=max(depth, PRESS_SCENE.least_depth_mm)).force)

    for depth, name in zip(PRINTED_N, DEPTH_NAMES, strict=True):
        others = [(d, np.log(p)) for d, p in PRINTED_N.items() if d != depth]
        alone = minimize_scalar(
            lambda offset, others=others: sum((np.log(force(d - offset)) - p) ** 2 for d, p in others),
            bounds=PRESS_SCENE.offsets_mm, method="bounded", options={"xatol": PRESS_SCENE.offset_accuracy_mm},
        ).x  # fmt: skip
        forces = [force(depth - offset) * (newton_to_gf(1.0) if depth < 1 else 1.0) for offset in (OFFSET_MM, 0, alone)]
        values |= zip((f"at_{name}", f"raw_{name}", f"at_{name}_alone"), map(float, forces), strict=True)
    return values


def _equations(reduced, cause: bool) -> dict:
    """Equations (6)-(8) against Hertz and against finite elements."""
    setup = PRESS_SCENE.equations
    exact = shared_approach(setup.force_N, setup.radius_mm, *setup.fingers_MPa)
    moduli = setup.half_spaces_MPa
    bodies = [HalfSpace(E) if cause else Block(E, setup.without_cause_mm) for E in moduli]
    presses = [fem.press(reduced, body, force=setup.pressed_N, fidelity="contact") for body in bodies]
    gives = [p.specimen_indentation * E / p.finger_indentation for p, E in zip(presses, moduli, strict=True)]
    soft, middle, hard = (1 / (1 + setup.fingers_MPa[0] / E) for E in setup.trend_MPa)
    bends = soft - 2 * middle + hard
    return {
        "area_ratio": printed_area(exact.first, exact.second, setup.radius_mm) / exact.area,
        "shared": gives[0] / gives[1],
        "w_o": " and ".join(f"{press.specimen_indentation:.4f}" for press in presses),
        "trend": math.copysign(1.0, setup.printed) / math.copysign(1.0, bends),
        "convex": 2 * setup.printed,
    }


def _second_design() -> dict:
    """The design of 2011 that ships."""
    design = Finger.load("one-gauge")
    return {"one_gauge": float(len(design.gauges)), "slab": design.name}


def _field(finger: Finger, reduced, cause: bool) -> dict:
    """Stress on the axis at 1 mm, and strains at 2.5 mm, with layers and in a homogeneous finger."""
    modulus = 0.5 * (finger.outer.modulus + finger.inner.modulus)
    plain = dataclasses.replace(
        finger,
        name="homogeneous",
        outer=dataclasses.replace(finger.outer, modulus=modulus),
        inner=dataclasses.replace(finger.inner, modulus=modulus),
    )
    built = mesh.build(finger)
    counts = np.bincount(built.layer)
    values: dict = {"layers": float((counts > 0).sum()), "tets": int(counts.sum())}
    values["by_layer"] = " and ".join(str(count) for count in counts if count)
    axes = {}
    for name, design in (("layers", finger if cause else plain), ("plain", plain)):
        model = fem.FingerModel(design, built)
        condensed = reduced if design is finger else model.reduce()
        moduli = np.where(built.layer == built.layer.max(), design.inner.modulus, design.outer.modulus)
        flat, field = HalfSpace(RIGID_MPA), PRESS_SCENE.field
        press = fem.press(condensed, flat, indentation=field.indentation_mm, fidelity="contact")
        axes[name] = _axis(built, fem.recover(model, condensed, press).strain, moduli)
        deep = fem.press(condensed, HalfSpace(RIGID_MPA), indentation=PRESS_SCENE.field.deep_mm, fidelity="contact")
        strain = fem.recover(model, condensed, deep).strain
        outer = built.layer == built.layer.min()
        values[f"strain_{name}"] = float(np.abs(np.linalg.eigvalsh(strain[outer])).max())
        values[f"gauge_{name}"] = float(np.abs(deep.strain).max())
    near_it, middle, under = axes["layers"]
    plain_near, plain_middle, _ = axes["plain"]
    return values | {
        "just_above": near_it,
        "mid_skin": middle,
        "below_it": under,
        "concentration": near_it / middle,
        "plain_ratio": plain_near / plain_middle,
        "protected": values["strain_layers"] / values["strain_plain"],
    }


def _axis(built, strain: np.ndarray, moduli: np.ndarray) -> tuple[float, float, float]:
    """Von Mises stress (kPa) on the axis: just above the boundary, in the middle of the skin, and its maximum below
    the boundary."""
    centre = built.points[built.tets].mean(axis=1)
    identity = np.eye(strain.shape[1])
    deviator = strain - np.trace(strain, axis1=1, axis2=2)[:, None, None] * identity / len(identity)
    mises = KPA_PER_MPA * moduli * np.sqrt(2 / len(identity) * (deviator**2).sum(axis=(1, 2)))
    setup, axis = PRESS_SCENE.field, np.hypot(centre[:, 0], centre[:, 1]) < PRESS_SCENE.field.axis_mm
    outer, z = built.layer == built.layer.min(), centre[:, 2]
    low, high = setup.mid_skin_mm
    parts = (outer & (z < setup.just_above_mm), outer & (z > low) & (z < high), ~outer & (z > setup.below_mm))
    above_it, middle, below_it = (mises[axis & region] for region in parts)
    return float(above_it.mean()), float(middle.mean()), float(below_it.max())


experiment = Experiment.of(run)
