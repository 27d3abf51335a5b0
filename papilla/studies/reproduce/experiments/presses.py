"""2006 II, IV and 2011 Okamoto 3.2: effects of a press on the layered finger, and equations (6)-(8)."""

import dataclasses
import math

import numpy as np
from scipy.optimize import minimize_scalar

from papilla import fem, mesh
from papilla.finger import Finger
from papilla.references import printed_area, shared_approach
from papilla.specimen import Block, HalfSpace
from papilla.studies.reproduce.claim import Found, Series, gathered
from papilla.units import gf_to_newton, newton_to_gf

RIGID_MPA = 1e4
PRINTED_N = {0.20: gf_to_newton(0.70), 0.80: gf_to_newton(38.37), 1.00: 0.6}
"""Force at a depth in mm: 2006 III.B.2 and 2011 Okamoto 3.2.3."""
OFFSET_MM = 0.155
"""Touch-down offset with which the papers' three points follow one power law, because their depths have another
zero."""
FORCE_N = 0.49
MODULI = tuple(np.geomspace(0.02, 20.0, 16).tolist())
SPECIMENS = (0.089, 0.51, 0.72)

SIMULATED = ""
SCENE = (
    "the difference between specimens (all have one modulus), the layers (a homogeneous finger), half-spaces (thin"
    " blocks instead), the order of the moduli",
)


def run(tell, cause: bool = True) -> Found:
    """What a press does to the layered finger: readings, stress, contact area, and how the approach is shared.

    The default finger is pressed on its reference mesh: on blocks of 0.02-20 MPa by 0.49 N, on the three published
    specimens by 60 gf, and on a rigid flat to the printed depths, with a touch-down offset and without. Displacements
    are recovered in the whole mesh at 1 and 2.5 mm, in the layered finger and in a homogeneous one of the mean modulus.
    Equations (6)-(8) are compared with Hertz's contact and with half-spaces of 0.2 and 2 MPa at 0.1 N.
    """
    finger = Finger.default()
    tell("the finger")
    reduced = fem.prepare(finger)
    specimens = {E: E if cause else 0.51 for E in SPECIMENS}
    at_60 = {E: fem.press(reduced, Block(own, 10.0), force=gf_to_newton(60.0)) for E, own in specimens.items()}
    tell("presses over the modulus, the field inside, with layers and without")
    values = gathered(
        lambda: _over_moduli(reduced, cause),
        lambda: _three(at_60),
        lambda: _depths(reduced),
        lambda: _equations(reduced, cause),
        lambda: _field(finger, reduced, cause),
        _second_design,
    )
    edge = np.linspace(0, 12, 60)
    pressures = [_along_x(reduced.patch, at_60[E].pressure, edge) for E in (0.089, 0.72)]
    series = (
        Series("0.089 MPa (soft)", edge, 1000 * pressures[0]),
        Series("0.72 MPa (hard)", edge, 1000 * pressures[1]),
    )
    title = "60 gf on a soft and on a hard specimen: the hard one is touched on less, and pushes harder"
    return Found(values, title, "distance from the middle of the contact, mm", "pressure, kPa", series)


def _over_moduli(reduced, cause: bool) -> dict:
    """Contact area, the finger's part of the indentation and S_d over the modulus."""
    table = [fem.press(reduced, Block(modulus if cause else 0.51, 10.0), force=FORCE_N) for modulus in MODULI]
    area = np.array([one.contact_area for one in table])
    gives = np.array([one.finger_indentation for one in table])
    sd = np.array([one.sd for one in table])
    return {
        "sd": ", ".join(f"{one:.0f}" for one in sd[::3]),
        "moduli": ", ".join(f"{one:.2g}" for one in MODULI[::3]),
        "area": ", ".join(f"{one:.0f}" for one in area[::3]),
        "area_falls": float(np.mean(np.diff(area / gives) < -1e-9)),
        "area_first": area[0] / gives[0],
        "area_last": area[-1] / gives[-1],
        "follows": float(np.corrcoef(sd, gives / area)[0, 1]) if np.ptp(sd) > 1e-6 * sd.max() else 0.0,
    }


def _three(at_60) -> dict:
    """The three published specimens under 60 gf."""
    return {
        "gauges": float(len(at_60[0.51].reading)),
        "readings": ", ".join(f"{100 * strain:+.2f}" for strain in at_60[0.51].strain),
        "softness_shows": at_60[0.72].sd / at_60[0.089].sd,
        "gain_low": at_60[0.51].sd / at_60[0.089].sd - 1,
        "gain_high": at_60[0.72].sd / at_60[0.51].sd - 1,
        "peak_ratio": at_60[0.72].peak_pressure / at_60[0.089].peak_pressure,
    }


def _along_x(patch, pressure: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Mean pressure (k,) on rings about these distances from the touch-down point."""
    radius = np.hypot(*patch.xy.T)
    width = 1.5 * patch.finest_edge
    weights = np.exp(-0.5 * ((radius[None, :] - places[:, None]) / width) ** 2)
    return (weights @ pressure) / weights.sum(axis=1)


def _depths(reduced) -> dict:
    """Force (gf, N) at the printed depths on a rigid flat, with and without the offset, and with the offset that
    follows from the other two points."""
    values: dict[str, float] = {}

    def force(depth: float) -> float:
        return float(fem.press(reduced, HalfSpace(RIGID_MPA), indentation=max(depth, 1e-3)).force)

    for depth in PRINTED_N:
        others = [(d, np.log(p)) for d, p in PRINTED_N.items() if d != depth]
        alone = minimize_scalar(
            lambda offset, others=others: sum((np.log(force(d - offset)) - p) ** 2 for d, p in others),
            bounds=(0.0, 0.19), method="bounded", options={"xatol": 1e-3},
        ).x  # fmt: skip
        shown = [force(depth - offset) * (newton_to_gf(1.0) if depth < 1 else 1.0) for offset in (OFFSET_MM, 0, alone)]
        values |= {
            name.format(round(100 * depth)): float(one)
            for name, one in zip(("at_{:03d}", "raw_{:03d}", "at_{:03d}_alone"), shown, strict=True)
        }
    return values


def _equations(reduced, cause: bool) -> dict:
    """Equations (6)-(8) against Hertz and against finite elements."""
    exact = shared_approach(0.3, 25.0, 0.1, 0.3)
    moduli = (0.2, 2.0)
    bodies = [HalfSpace(E) if cause else Block(E, 2.0) for E in moduli]
    presses = [fem.press(reduced, body, force=0.1, fidelity="contact") for body in bodies]
    gives = [one.specimen_indentation * E / one.finger_indentation for one, E in zip(presses, moduli, strict=True)]
    soft, middle, hard = (1 / (1 + 0.1 / E) for E in (0.2, 0.5, 0.8))
    bends = soft - 2 * middle + hard
    return {
        "area_ratio": printed_area(exact.first, exact.second, 25.0) / exact.area,
        "shared": gives[0] / gives[1],
        "w_o": " and ".join(f"{one.specimen_indentation:.4f}" for one in presses),
        "trend": math.copysign(1.0, 87.2) / math.copysign(1.0, bends),
        "convex": 2 * 87.2,
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
    found: dict = {"layers": float((counts > 0).sum()), "tets": int(counts.sum())}
    found["by_layer"] = " and ".join(str(count) for count in counts if count)
    axes = {}
    for name, design in (("layers", finger if cause else plain), ("plain", plain)):
        model = fem.FingerModel(design, built)
        own = reduced if design is finger else model.reduce()
        moduli = np.where(built.layer == built.layer.max(), design.inner.modulus, design.outer.modulus)
        press = fem.press(own, HalfSpace(RIGID_MPA), indentation=1.0, fidelity="contact")
        axes[name] = _axis(built, fem.recover(model, own, press).strain, moduli)
        deep = fem.press(own, HalfSpace(RIGID_MPA), indentation=2.5, fidelity="contact")
        strain = fem.recover(model, own, deep).strain
        outer = built.layer == built.layer.min()
        found[f"strain_{name}"] = float(np.abs(np.linalg.eigvalsh(strain[outer])).max())
        found[f"gauge_{name}"] = float(np.abs(deep.strain).max())
    near_it, middle, under = axes["layers"]
    plain_near, plain_middle, _ = axes["plain"]
    return found | {
        "just_above": near_it,
        "mid_skin": middle,
        "below_it": under,
        "concentration": near_it / middle,
        "plain_ratio": plain_near / plain_middle,
        "protected": found["strain_layers"] / found["strain_plain"],
    }


def _axis(built, strain: np.ndarray, moduli: np.ndarray) -> tuple[float, float, float]:
    """Von Mises stress (kPa) on the axis: just above the boundary, in the middle of the skin, and its maximum within 3
    mm below the boundary."""
    centre = built.points[built.tets].mean(axis=1)
    deviator = strain - np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(3) / 3
    mises = 1000 * moduli * np.sqrt(2 / 3 * (deviator**2).sum(axis=(1, 2)))
    axis = np.hypot(centre[:, 0], centre[:, 1]) < 1.5
    outer, z = built.layer == built.layer.min(), centre[:, 2]
    parts = (outer & (z < 17.9), outer & (z > 18.1) & (z < 19.1), ~outer & (z > 14))
    above_it, middle, below_it = (mises[axis & part] for part in parts)
    return float(above_it.mean()), float(middle.mean()), float(below_it.max())
