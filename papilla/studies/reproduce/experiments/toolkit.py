"""What papilla itself is for: calibration from finite elements, pictures, prices, hard cases, friction."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import papilla
from papilla import fem, mesh, view
from papilla.calibrate import check
from papilla.calibrate.job import cached_sweep
from papilla.calibrate.press_table import DEFAULT_FORCES, DEFAULT_MODULI, SPECIMENS_MPA
from papilla.calibration import Calibration
from papilla.estimators import Friction
from papilla.fem.field_files import save_field
from papilla.fem.pressing.prices import known_prices
from papilla.finger import Finger
from papilla.logs import PressLog, read_time_log
from papilla.specimen import STICK, Block
from papilla.studies.reproduce.claim import Claim, Experiment, Found, Series, above, below, near
from papilla.studies.reproduce.experiments.softness import calibrated
from papilla.studies.verify import verify
from papilla.tables import write_table

CALIBRATE, FRICTION = "papilla calibrate", "estimators.Friction().process(block)"
TRUE_MU = (0.45, 0.60)
"""Kinetic and static friction of the simulated log."""
LEVER_MM, OFFSET_N = 40.0, 0.03

CLAIMS = (
    Claim("A7", "2006 II, V", "Static and dynamic friction come from the force at the base", TRUE_MU[0],
          near(TRUE_MU[0], by=0.02), "kinetic coefficient", "mu_kinetic", FRICTION,
          "simulated: 0.45, 0.60 and an offset of 0.03 N that both directions take out; static {mu_static:.3f}"),
    Claim("A7b", "2006 II, V", "The static coefficient from the breakaway", TRUE_MU[1], near(TRUE_MU[1], by=0.04),
          "static coefficient", "mu_static", FRICTION, "simulated"),
    Claim("A8", "2006 II", "The sensor at the base measures a torque", TRUE_MU[0], near(TRUE_MU[0], by=0.02),
          "kinetic coefficient", "mu_torque", "papilla estimate LOG.csv --lever-mm 40 (column torque_Nmm)",
          "the same log as a torque about a point 40 mm away"),
    Claim("F1", "card", "Regenerate calibration coefficients", 5.0, near(5.0), "coefficients", "coefficients",
          CALIBRATE, "{refit}, with their covariance and an exact inverse of four"),
    Claim("F2", "card", "A tetrahedral mesh of the two-layer finger", 1000.0, above(1000.0), "tetrahedra", "tets",
          "mesh.build", "made by pytetwild, snapped to the exact surfaces"),
    Claim("F3", "card", "Solved with scikit-fem", 1.0, near(1.0), "basis of that library", "skfem", "fem.FingerModel",
          "spaces, bases and quadrature are its own; assembly and solver papilla's"),
    Claim("F4", "card", "Under Hertzian loads", 0.0, below(0.02), "relative error of S_d", "hertz",
          "papilla press --fidelity hertz", "against contact at 0.1-0.9 N on 0.51 MPa"),
    Claim("F5", "card", "Objects of varying Young's modulus", 43.0, above(10.0), "moduli in the table", "moduli",
          CALIBRATE),
    Claim("F6", "card", "Strain at the five gauge sites", 5.0, near(5.0), "gauges", "gauges", "papilla press --json"),
    Claim("F7", "card", "Refits S_d(f, E) and its inverse", 0.0, below(1e-9),
          "relative error of the inverse of the quadratic", "inverse_exact", "Calibration.inverse",
          "of the quadratic's own S_d; on presses see A40"),
    Claim("F9", "card", "Visualises strain fields", 1.0, near(1.0), "picture", "picture", "papilla view strain",
          "{picture_bytes} bytes of PNG, cut open under 60 gf"),
    Claim("F10", "card", "The recovered field can be taken into other tools", 1.0, near(1.0), "file", "exported",
          "fem.field_files.save_field(field, path)", "VTU with displacement, strain and layer, read back by meshio"),
    Claim("F11", "card", "The inverse modulus estimate is tested", 0.0, below(0.02), "largest error of E", "own_mesh",
          "papilla calibrate: max_error",
          "{own_count} presses between the table's points, 20-100 gf, 0.05-0.72 MPa, the same mesh"),
    Claim("F12", "card", "A user can test his own calibration so", 1.0, near(1.0), "right and wrong told apart",
          "checked", "papilla calibrate --check PRESSES.csv", "{passed} of {presses} right presses pass; with moduli "
          "stated 1.5 x too high {wrong} of {presses} are named"),
    Claim("F13", "card", "Reports speed against error", 3.0, above(3.0), "fidelity, quantity and mesh priced",
          "prices", "papilla bench", "what ships of it: {priced}"),
    Claim("F14", "card", "Tests numerical stability on hard cases", 1.0, near(1.0), "share within bounds", "hard",
          "papilla verify", "of {hard_cases} cases of the families patch and slivers; papilla verify has all"),
    Claim("F15", "card", "Models only what a scene needs", 0.25, near(0.25, by=0.1), "cells solved over cells",
          "quarter", "fem.FingerModel", "two mirror planes leave a quarter; roughness scenes are a plane section"),
    Claim("F16", "card", "The error of small strain is in the stated sigma", 1.0, near(1.0), "named part of sigma",
          "strain_named", "Calibration.sigmas", "{sigmas}"),
    Claim("F17", "card", "Packages for mesh, finite elements, calibration and estimators", 4.0, near(4.0), "packages",
          "packages", "import papilla"),
    Claim("F18", "card", "Notebooks", "two", cannot="the notebooks lie beside the package, whose tests execute them"),
)  # fmt: skip


def run(tell) -> Found:
    """Checks of the main job on the default finger."""
    finger = Finger.default()
    tell("calibration")
    reduced = fem.prepare(finger)
    calibration = calibrated(reduced)
    values = {**_friction(), **_main_job(calibration, reduced)}
    tell("mesh and model")
    built = mesh.build(finger)
    model = fem.FingerModel(finger, built)
    prices = known_prices(reduced.finger_sha256, reduced.mesh_sha256)
    parts = () if prices is None else tuple(name for name in ("hertz", "mesh", "small_strain") if getattr(prices, name))
    pairs = [
        [fem.press(reduced, Block(0.51, 10.0), force=force, fidelity=one).sd for one in ("hertz", "contact")]
        for force in (0.1, 0.4, 0.9)
    ]
    values |= {
        "tets": float(len(built.tets)),
        "skfem": float(type(model.space.displacement).__module__.startswith("skfem")),
        "quarter": len(model.space.mesh.tets) / len(built.tets),
        "hertz": max(abs(hertz / contact - 1) for hertz, contact in pairs),
        "prices": float(len(parts)),
        "priced": ", ".join(part.replace("_", " ") for part in parts),
        "packages": float(sum(hasattr(papilla, name) for name in ("mesh", "fem", "calibrate", "estimators"))),
    }
    tell("strain field")
    press = fem.press(reduced, Block(0.51, 10.0), force=0.588, fidelity="contact")
    picture = view.strain_picture(finger, reduced, press, Block(0.51, 10.0))
    tell("hard cases")
    cases = verify(["patch", "slivers"])
    values |= {
        "exported": _exported(fem.recover(model, reduced, press)),
        "gauges": float(len(press.strain)),
        "picture": float(picture.startswith(b"\x89PNG") and len(picture) > 10_000),
        "picture_bytes": len(picture),
        "hard": float(np.mean([case.passed for case in cases])),
        "hard_cases": len(cases),
    }
    names = list(calibration.sigmas)
    series = (Series("one sigma of S_d", names, [100 * calibration.sigmas[name] for name in names], "bars"),)
    return Found(values, "What the sigma of a modulus comes from, besides the measurement", "", "% of S_d", series)


def _exported(field: fem.Field) -> float:
    """1 where the file of a field holds what the field does."""
    import meshio

    with TemporaryDirectory() as folder:
        path = Path(folder) / "field.vtu"
        save_field(field, path)
        back = meshio.vtu.read(str(path))
    return float(np.array_equal(back.point_data["displacement_mm"], field.displacement))


def _friction() -> dict:
    """A simulated swipe to and fro: tangential force with breakaways, and the same as a torque."""
    rng = np.random.default_rng(50)
    time = np.arange(8000) / 1000
    phase = np.sin(2 * np.pi * 0.25 * time + 1e-3)
    velocity = np.where(np.abs(phase) < 0.2, 0.0, 30.0 * np.sign(phase))
    force = 0.5 + 0.1 * np.sin(2 * np.pi * 0.11 * time)
    starts = np.flatnonzero((velocity != 0) & (np.append(0.0, velocity[:-1]) == 0))
    mu = np.where(velocity != 0, TRUE_MU[0], 0.0) * np.sign(velocity)
    for start in starts:
        # The force climbs to the breakaway while the finger rests
        first = max(0, int(start) - 150)
        mu[first:start] = np.linspace(0, TRUE_MU[1], int(start) - first) * np.sign(velocity[start])
    drag = mu * force + OFFSET_N + 1e-3 * rng.standard_normal(len(time))
    last = {}
    for name, tangential in (("force", drag), ("torque", _by_torque(time, force, velocity, drag))):
        found = Friction(sample_rate_Hz=1000.0).process(np.column_stack([tangential, force, velocity]))
        for key in ("mu_kinetic", "mu_static"):
            column = np.asarray(getattr(found, key))
            last[name, key] = float(column[np.isfinite(column)][-1]) if np.isfinite(column).any() else float("nan")
    return {
        "mu_kinetic": last["force", "mu_kinetic"],
        "mu_static": last["force", "mu_static"],
        "mu_torque": last["torque", "mu_kinetic"],
    }


def _by_torque(time, force, velocity, drag) -> np.ndarray:
    """The tangential force (n,) that is read of a log which holds a torque."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "torque.csv"
        columns = {"t_s": time, "force_N": force, "velocity_mm_s": velocity, "torque_Nmm": LEVER_MM * drag}
        write_table(path, columns)
        log = read_time_log(path, lever_mm=LEVER_MM)
    assert log.tangential_N is not None
    return log.tangential_N


def _main_job(calibration: Calibration, reduced) -> dict:
    """Coefficients, recovered moduli on the same mesh, and the check of right and of wrong presses."""
    between = [float(np.sqrt(a * b)) for a, b in zip(DEFAULT_FORCES[30:], DEFAULT_FORCES[31:], strict=False)][::6]
    moduli = np.geomspace(0.053, 0.7, 7).tolist()
    table = cached_sweep(reduced, tuple(moduli), tuple(between), reduced.bench.specimen, STICK)
    error = np.abs(
        np.asarray(calibration.invert(table.sd_microstrain, table.force_N).modulus_MPa) / table.modulus_MPa - 1
    )
    names = tuple(f"g{k + 1}" for k in range(table.reading.shape[1]))
    soft = table.modulus_MPa < 0.2
    right = PressLog(table.force_N[soft], table.modulus_MPa[soft], table.reading[soft], names)
    wrong = PressLog(right.force_N, 1.5 * right.modulus_MPa, right.readings, names)
    told, named = check(calibration, right), check(calibration, wrong)
    force, modulus = np.meshgrid(
        [20.0, 60.0, 100.0], np.linspace(*(calibration.inverse.modulus_MPa or SPECIMENS_MPA[:2]), 9)
    )
    inner = modulus[:, :] * 0.98 + 0.02 * modulus.mean()
    back = calibration.inverse(calibration.forward(force, inner), force)
    return {
        "coefficients": float(len(calibration.forward.coefficients)),
        "refit": ", ".join(f"{value:.4g}" for value in calibration.forward.coefficients),
        "moduli": float(len(DEFAULT_MODULI)),
        "inverse_exact": float(np.abs(back / inner - 1).max()),
        "own_mesh": float(np.max(error)),
        "own_count": len(error),
        "passed": len(told.presses) - told.missed,
        "presses": len(told.presses),
        "wrong": named.missed,
        "checked": float(told.passed and not named.passed and named.missed > 0.9 * len(named.presses)),
        "strain_named": float("large strain" in calibration.sigmas),
        "sigmas": ", ".join(f"{name} {100 * value:.2f} %" for name, value in calibration.sigmas.items()),
    }


EXPERIMENT = Experiment(
    "toolkit", "What papilla is for: calibration, pictures, prices, hard cases, friction", CLAIMS, run,
    "the default finger; a simulated swipe for friction",
)  # fmt: skip
