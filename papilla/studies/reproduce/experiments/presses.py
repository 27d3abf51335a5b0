"""2006 II, IV and 2011 Okamoto 3.2: what a press does to the layered finger, and equations (6)-(8)."""

import dataclasses
import math

import numpy as np

from papilla import fem, mesh
from papilla.finger import Finger
from papilla.references import printed_area, shared_approach
from papilla.specimen import Block, HalfSpace
from papilla.studies.reproduce.claim import TRUE, Claim, Experiment, Found, Series, above, below, near
from papilla.units import gf_to_newton, newton_to_gf

RIGID_MPA = 1e4
OFFSET_MM = 0.155
"""Touch-down offset that joins the papers' three points in one power law: they are by another zero of the depth."""
PRESS = "papilla press --modulus E --indentation D"
FORCE_N = 0.49
MODULI = tuple(np.geomspace(0.02, 20.0, 16).tolist())
SPECIMENS = (0.089, 0.51, 0.72)

CLAIMS = (
    Claim("A1", "2006 II, fig. 1", "A hard outer and a soft inner silicone layer over an acrylic bone", 2.0,
          near(2.0), "layers of tetrahedra", "layers", "mesh.build(Finger.default())",
          "{tets} tetrahedra: {by_layer}"),
    Claim("A2", "2006 II", "Five strain gauges lie on the boundary of the layers", 5.0, near(5.0), "gauges", "gauges",
          "Press.reading", "read {readings} % at 60 gf on 0.51 MPa; places and directions are assumptions"),
    Claim("A4", "2006 II", "Stress concentrates around the boundary of the layers", "qualitative", above(1.5),
          "von Mises stress over that in mid skin", "concentration", "fem.recover(model, reduced, press)",
          "on the axis under 1 mm of a rigid flat: {just_above:.1f} kPa just above the boundary, {mid_skin:.1f} in "
          "the middle of the skin, at most {below_it:.1f} below it; in a homogeneous finger {plain_ratio:.2f}"),
    Claim("A6", "2006 II", "The spread of the five gauges reflects softness", "qualitative", above(1.05),
          "S_d at 0.72 over 0.089 MPa", "softness_shows", "papilla press --modulus E --force 0.49",
          "{sd} microstrain at {moduli} MPa"),
    Claim("A21", "2006 III.B.2", "Reaction of 38.37 gf at a depth of 0.80 mm", 38.37, near(38.37, percent=10), "gf",
          "at_080", PRESS, "default finger and a touch-down offset of 0.155 mm, on a rigid flat; {raw_080:.1f} gf "
          "without an offset: the zero of the printed depth is not that of first contact"),
    Claim("A21b", "2006 III.B.2", "Reaction of 0.70 gf at a depth of 0.20 mm", 0.70, near(0.70, by=0.5), "gf",
          "at_020", PRESS, "the same; {raw_020:.1f} gf without an offset"),
    Claim("A30", "2006 eq. (6)", "Contact area of two spheres is pi R (w_f + w_o)", 1.0, near(1.0, percent=5),
          "printed over Hertz's", "area_ratio", "references.printed_area, references.shared_approach",
          "twice too large for two spheres of radius R each; right for one of radius R on a flat"),
    Claim("A31", "2006 eq. (7)", "Finger and object share the approach as w_o / w_f = E_f / E_o", 1.0,
          near(1.0, percent=5), "w_o E_o over w_f E_f, 0.2 over 2 MPa", "shared", "Press.finger_indentation",
          "finite elements on half-spaces at 0.1 N: {w_o} mm of the object at 0.2 and 2 MPa; in closed form it is "
          "exact"),
    Claim("A32", "2006 eq. (8)", "A / w_f is pi R (1 + E_f / E_o): smaller on a harder object", "falls with E_o",
          TRUE, "share of steps that fall", "area_falls", "Press.contact_area / Press.finger_indentation",
          "from {area_first:.0f} to {area_last:.0f} mm over 0.02-20 MPa at 0.49 N"),
    Claim("X5", "2006 eqs (8), (9)", "(8), without force and saturating, and (9), convex in E, agree on the trend",
          1.0, near(1.0, by=0.5), "curvature sign of (9) over that of (8)", "trend", "closed forms",
          "inconsistent in print: S_d as w_f / A by (8) bends down in E, (9) bends up by {convex:.0f} a MPa^2, and a "
          "harder object gives ever less in the model: S_d {gain_low:+.1%} from 0.089 to 0.51 MPa, {gain_high:+.1%} "
          "to 0.72"),
    Claim("A33", "2006 IV.A", "S_d follows w_f / A", "trend", above(0.9), "correlation over 0.02-20 MPa", "follows",
          "papilla press", "at 0.49 N; area {area} mm2"),
    Claim("A34", "2006 fig. 10", "On a hard object the reaction is on a smaller area, and higher in the middle",
          "drawing", above(1.2), "peak pressure, hard over soft", "peak_ratio", "papilla view contact",
          "the picture of this experiment: 0.089 beside 0.72 MPa at 60 gf"),
    Claim("C12", "2011 Okamoto 3.2.2", "A sensor of 10 mm thickness with one gauge beneath the ridges", 1.0,
          near(1.0), "gauges", "one_gauge", "papilla press --finger one-gauge",
          "ships as a second design, {slab}; not pressed here, where it would be meshed anew"),
    Claim("C14", "2011 Okamoto 3.2.2", "The layers keep the skin from deforming: no saturation at 2.5 mm",
          "qualitative", below(0.9), "strain of the skin over that without layers", "protected",
          "fem.recover at 2.5 mm", "small strain, a rigid flat: largest strain of the outer layer "
          "{strain_layers:.3f} against {strain_plain:.3f} in a homogeneous finger of the same mean stiffness of "
          "press, largest gauge strain {gauge_layers:.3f} against {gauge_plain:.3f}"),
    Claim("C16", "2011 Okamoto 3.2.3", "A depth of 1 mm takes about 0.6 N", 0.6, near(0.6, percent=10), "N", "at_100",
          PRESS, "the default finger (of 2006) with the same offset; {raw_100:.2f} N without"),
)  # fmt: skip


def run(tell) -> Found:
    """Presses of the default finger on its reference mesh."""
    finger = Finger.default()
    tell("the finger")
    reduced = fem.prepare(finger)
    built = mesh.build(finger)
    tell("presses over the modulus")
    table = [fem.press(reduced, Block(modulus, 10.0), force=FORCE_N) for modulus in MODULI]
    area = np.array([one.contact_area for one in table])
    finger_gives = np.array([one.finger_indentation for one in table])
    sd = np.array([one.sd for one in table])
    at_60 = {E: fem.press(reduced, Block(E, 10.0), force=gf_to_newton(60.0)) for E in SPECIMENS}
    counts = np.bincount(built.layer)
    values = {
        "layers": float((counts > 0).sum()),
        "tets": int(counts.sum()),
        "by_layer": " and ".join(str(count) for count in counts if count),
        "gauges": float(len(at_60[0.51].reading)),
        "readings": ", ".join(f"{100 * strain:+.2f}" for strain in at_60[0.51].strain),
        "sd": ", ".join(f"{one:.0f}" for one in sd[::3]),
        "moduli": ", ".join(f"{one:.2g}" for one in MODULI[::3]),
        "area": ", ".join(f"{one:.0f}" for one in area[::3]),
        "softness_shows": at_60[0.72].sd / at_60[0.089].sd,
        "gain_low": at_60[0.51].sd / at_60[0.089].sd - 1,
        "gain_high": at_60[0.72].sd / at_60[0.51].sd - 1,
        "area_falls": float(np.mean(np.diff(area / finger_gives) < 0)),
        "area_first": area[0] / finger_gives[0],
        "area_last": area[-1] / finger_gives[-1],
        "follows": float(np.corrcoef(sd, finger_gives / area)[0, 1]),
        "peak_ratio": at_60[0.72].peak_pressure / at_60[0.089].peak_pressure,
        **_depths(reduced),
        **_equations(reduced),
        **_second_design(),
    }
    tell("the field inside, with layers and without")
    values |= _field(finger, reduced)
    edge = np.linspace(0, 12, 60)
    pressures = [_along_x(reduced.patch, at_60[E].pressure, edge) for E in (0.089, 0.72)]
    series = (
        Series("0.089 MPa (soft)", edge, 1000 * pressures[0]),
        Series("0.72 MPa (hard)", edge, 1000 * pressures[1]),
    )
    title = "60 gf on a soft and on a hard specimen: the hard one is touched on less, and pushes harder"
    return Found(values, title, "distance from the middle of the contact, mm", "pressure, kPa", series)


def _along_x(patch, pressure: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Mean pressure (k,) on rings about these distances from the touch-down point."""
    radius = np.hypot(*patch.xy.T)
    width = 1.5 * patch.finest_edge
    weights = np.exp(-0.5 * ((radius[None, :] - places[:, None]) / width) ** 2)
    return (weights @ pressure) / weights.sum(axis=1)


def _depths(reduced) -> dict:
    """Force (gf, N) at the printed depths on a rigid flat, with the offset and without."""
    values: dict[str, float] = {}
    for depth in (0.20, 0.80, 1.00):
        force = [fem.press(reduced, HalfSpace(RIGID_MPA), indentation=d).force for d in (depth - OFFSET_MM, depth)]
        shown = [float(newton_to_gf(one)) for one in force] if depth < 1 else force
        values |= {f"at_{round(100 * depth):03d}": shown[0], f"raw_{round(100 * depth):03d}": shown[1]}
    return values


def _equations(reduced) -> dict:
    """Equations (6)-(8) against Hertz and against finite elements."""
    exact = shared_approach(0.3, 25.0, 0.1, 0.3)
    moduli = (0.2, 2.0)
    presses = [fem.press(reduced, HalfSpace(E), force=0.1, fidelity="contact") for E in moduli]
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


def _field(finger: Finger, reduced) -> dict:
    """Stress on the axis at 1 mm, and strains at 2.5 mm, with layers and in a homogeneous finger."""
    modulus = 0.5 * (finger.outer.modulus + finger.inner.modulus)
    plain = dataclasses.replace(
        finger,
        name="homogeneous",
        outer=dataclasses.replace(finger.outer, modulus=modulus),
        inner=dataclasses.replace(finger.inner, modulus=modulus),
    )
    built = mesh.build(finger)
    found: dict[str, float] = {}
    axes = {}
    for name, design in (("layers", finger), ("plain", plain)):
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
    """Von Mises stress (kPa) on the axis: just above the boundary, in mid skin, and its greatest in 3 mm below it."""
    centre = built.points[built.tets].mean(axis=1)
    deviator = strain - np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(3) / 3
    mises = 1000 * moduli * np.sqrt(2 / 3 * (deviator**2).sum(axis=(1, 2)))
    axis = np.hypot(centre[:, 0], centre[:, 1]) < 1.5
    outer, z = built.layer == built.layer.min(), centre[:, 2]
    parts = (outer & (z < 17.9), outer & (z > 18.1) & (z < 19.1), ~outer & (z > 14))
    above_it, middle, below_it = (mises[axis & part] for part in parts)
    return float(above_it.mean()), float(middle.mean()), float(below_it.max())


EXPERIMENT = Experiment(
    "presses",
    "What a press does to the layered finger: readings, stress, contact area, and how the approach is shared",
    CLAIMS,
    run,
)
