"""The report's tables: coefficients with their errors, the published ones beside them, contact, mesh, provenance."""

import numpy as np

from papilla import mesh
from papilla.calibrate.job import Calibrated
from papilla.calibrate.press_table import Sweep
from papilla.calibrate.published import (
    PUBLISHED_FORWARD,
    PUBLISHED_INVERSE,
    SPECIMENS_MPA,
    Comparison,
    exact_inverse,
    rounding_error,
)
from papilla.calibrate.report.html import Markup, join, number, plain, table, tag
from papilla.calibration.quadratic import QuadraticInverse
from papilla.finger import Finger
from papilla.units import gf_to_newton, newton_to_gf

TERMS = ("a (f²)", "b (f)", "c (E²)", "d (E)", "e (1)")
FORWARD_UNITS = ("µε/gf²", "µε/gf", "µε/MPa²", "µε/MPa", "µε")
INVERSE_TERMS = ("S_d", "f²", "f", "1")
SLOPE_FORCE_N = gf_to_newton(50.0)
SLOPE_MODULI = (0.05, 0.089, 0.2, 0.51, 0.72, 2.0, 5.0)
CONTACT_FORCES = (0.05, 0.1, 0.2, 0.5, 1.0)
PERCENT, KPA = 100.0, 1000.0


def forward_section(done: Calibrated, comparison: Comparison | None) -> Markup:
    """The quadratic with standard errors, and (9) beside it."""
    forward = done.calibration.forward
    low, high = (plain(value) for value in forward.modulus_MPa)
    head = ["coefficient", "value", "standard error", "unit"]
    rows: list[list[object]] = [
        [term, number(value, 5), number(error, 2), unit]
        for term, value, error, unit in zip(TERMS, forward.coefficients, forward.stderr, FORWARD_UNITS, strict=True)
    ]
    if comparison is not None:
        head += [f"× {number(comparison.scale)}", "published (9)"]
        for row, value, published in zip(rows, forward.coefficients, PUBLISHED_FORWARD, strict=True):
            row += [number(comparison.scale * value), plain(published)]
    parts = [
        tag("p", f"The form of (9), fitted by least squares over {low} to {high} MPa, with f in gf and E in MPa:"),
        tag("div", "S_d = a f² + b f + c E² + d E + e", class_="formula"),
        table(head, rows),
        tag("p", f"Residual {number(forward.rms)} µε rms, {number(forward.max)} µε at most."),
    ]
    if comparison is not None:
        text = (
            f"The published unit of S_d is not stated; one factor, {number(comparison.scale)} per µε, brings the "
            f"calibration as "
            f"close to (9) as it gets at {', '.join(f'{value:g}' for value in SPECIMENS_MPA)} MPa and "
            f"{comparison.force_gf[0]:g} to {comparison.force_gf[-1]:g} gf. What remains is "
            f"{number(PERCENT * comparison.relative_rms)} % rms."
        )
        parts.append(tag("p", text))
    return join(parts)


def inverse_section(done: Calibrated) -> Markup:
    """The exact inverse with branch and range; (9)'s own inverse and the printed (10)."""
    inverse = done.calibration.inverse
    exact, printed = exact_inverse(), PUBLISHED_INVERSE
    columns = (inverse, exact, printed)
    rows: list[list[object]] = [
        [term, *(number(column.coefficients[place], 5) for column in columns)]
        for place, term in enumerate(INVERSE_TERMS)
    ]
    rows.append(["shift (MPa)", *(number(column.shift, 5) for column in columns)])
    rows.append(["branch", *("+" if column.branch > 0 else "−" for column in columns)])
    rows.append(["rising range (MPa)", _range(inverse), "", ""])
    cost = rounding_error(printed)
    loss = (
        f"(10) as printed, with two digits, misses the exact inverse of (9) by up to "
        f"{number(cost.largest_MPa, 2, sign=True)} MPa "
        f"({number(PERCENT * cost.relative, 2, sign=True)} % at {cost.at_MPa:g} MPa and {cost.at_gf:g} gf; "
        f"{number(cost.rms_MPa, 2)} MPa rms over 5 to 100 gf and 0.05 to 1 MPa). The file keeps full precision."
    )
    return join(
        [
            tag(
                "div", f"E = {'−' if inverse.branch < 0 else ''}√(k₀ S_d + k₁ f² + k₂ f + k₃) − shift", class_="formula"
            ),
            table(["term", "this calibration", "exact inverse of (9)", "(10) as printed"], rows),
            tag("p", loss),
        ]
    )


def _range(inverse: QuadraticInverse) -> str:
    if inverse.modulus_MPa is None:
        return "none"
    return " to ".join(number(value) for value in inverse.modulus_MPa)


def slopes_table(done: Calibrated) -> Markup:
    """How steeply S_d follows E, and what the mesh scatter makes of it, at 50 gf or the middle of the domain."""
    calibration = done.calibration
    low, high = calibration.domain["force_N"]
    force = SLOPE_FORCE_N if low <= SLOPE_FORCE_N <= high else (low * high) ** 0.5
    scatter = calibration.surface.uncertainty.scatter_at(force)
    rows = []
    for modulus in SLOPE_MODULI:
        slope = float(calibration.surface.surface.slopes(force, modulus)[1])
        if np.isfinite(slope):
            cost = f"{number(PERCENT * scatter / slope, 2)} %" if slope > 0 else "no inverse"
            rows.append((plain(modulus), number(slope), f"{number(PERCENT * scatter, 2)} %", cost))
    head = ["E (MPa)", "d ln S_d / d ln E", "mesh scatter of S_d", "scatter of E"]
    return join([tag("h3", f"How steeply S_d follows E at {number(force)} N"), table(head, rows)])


def contact_section(done: Calibrated) -> Markup | None:
    """Indentation, area, peak pressure and S_d at a few forces and the published moduli; None without a sweep."""
    sweep = done.presses
    if not isinstance(sweep, Sweep):
        return None
    rows = []
    for modulus in SPECIMENS_MPA:
        near = np.flatnonzero(
            np.isclose(sweep.modulus_MPa, sweep.modulus_MPa[np.abs(sweep.modulus_MPa - modulus).argmin()])
        )
        for force in CONTACT_FORCES:
            row = near[np.abs(np.log(sweep.force_N[near] / force)).argmin()]
            rows.append(
                [
                    plain(sweep.modulus_MPa[row]),
                    number(sweep.force_N[row]),
                    number(newton_to_gf(sweep.force_N[row])),
                    number(sweep.indentation_mm[row]),
                    number(sweep.contact_area_mm2[row]),
                    number(KPA * sweep.peak_pressure_MPa[row]),
                    number(sweep.sd_microstrain[row], 4),
                ]
            )
    head = ["E (MPa)", "force (N)", "(gf)", "indentation (mm)", "area (mm²)", "peak pressure (kPa)", "S_d (µε)"]
    return table(head, rows)


def mesh_section(done: Calibrated, finger: Finger) -> Markup:
    """Figures of the mesh of the sweep, and the scatter between meshes."""
    assert done.reduced is not None
    figures = mesh.quality(mesh.build(finger, size_mm=done.reduced.mesh_size_mm))
    volumes = ", ".join(f"{name} {number(value, 4)}" for name, value in figures["volume_mm3"].items())
    rows = [
        ("element size at the contact (mm)", plain(done.reduced.mesh_size_mm)),
        ("tetrahedra, vertices", f"{plain(figures['cells'])}, {plain(figures['points'])}"),
        ("contact nodes (of the part that mirrors repeat)", str(len(done.reduced.patch.xy))),
        ("mean ratio, mean and least (1 is regular)", _pair(figures, "mean_ratio_mean", "mean_ratio_min")),
        ("dihedral angles (degrees)", _pair(figures, "dihedral_min_deg", "dihedral_max_deg")),
        ("edges (mm)", _pair(figures, "edge_min_mm", "edge_max_mm")),
        ("volumes (mm³)", volumes),
    ]
    if (terms := done.calibration.position) is not None:
        rows.append(("contacts calibrated along the finger (mm)", f"−{terms.reach_mm:g} to {terms.reach_mm:g}"))
    known = done.calibration.surface.uncertainty
    parts = [table(["", ""], rows)]
    if known.meshes:
        scatter = [
            (number(force), f"{number(PERCENT * share, 2)} %")
            for force, share in zip(known.scatter_force_N, known.scatter, strict=True)
        ]
        parts.append(tag("h3", f"Scatter of S_d between this mesh and {known.meshes} independent ones"))
        parts.append(table(["force (N)", "rms difference"], scatter))
    return join(parts)


def _pair(figures: dict, first: str, second: str) -> str:
    return f"{number(figures[first])}, {number(figures[second])}"


def provenance_section(done: Calibrated) -> Markup:
    """Finger, mesh, versions and when."""
    calibration = done.calibration
    facts = {f"finger: {key}": value for key, value in calibration.finger.items() if value}
    facts |= {f"mesh: {key}": value for key, value in calibration.mesh.items()}
    facts |= calibration.provenance
    rows = []
    for key, value in facts.items():
        if isinstance(value, dict):
            value = ", ".join(f"{name} {item}" for name, item in value.items())
        elif isinstance(value, list | tuple):
            value = ", ".join(map(str, value))
        rows.append((key.replace("_", " "), value))
    return table(["", ""], rows, text_columns=(1,))
