"""Properties of papilla itself: calibration from finite elements, pictures, cost, hard cases, friction."""

from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.image import imread

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
from papilla.studies.reproduce.claim import Found, Series, gathered
from papilla.studies.reproduce.experiments.softness import calibrated
from papilla.studies.verify import verify
from papilla.tables import write_table

TRUE_MU = (0.45, 0.60)
"""Kinetic and static friction of the simulated log."""
LEVER_MM, OFFSET_N = 40.0, 0.03
COLOURED = 0.15
"""Difference between the channels of a pixel (0 to 1) above which it is coloured, as strain is and text and shades are
not."""

SIMULATED = "the default finger; a simulated swipe for friction"


SCENE = (
    "the right modulus, the right force (a tenth more), half of the friction, wrong presses (right ones instead)",
    "white, 1 mN of the tangential force",
)


def run(tell, cause: bool = True) -> Found:
    """What papilla is for: calibration, pictures, prices, hard cases, friction.

    The default finger is calibrated and its presses between the table's points are recovered; a strain field is drawn
    and written; two families of `papilla verify` run. Friction comes from a simulated swipe to and fro with breakaways.
    """
    finger = Finger.default()
    tell("calibration")
    reduced = fem.prepare(finger)
    calibration = calibrated(reduced)
    tell("mesh, model and hard cases")
    values = gathered(
        lambda: _friction(cause),
        lambda: _main_job(calibration, reduced, cause),
        lambda: _model(finger, reduced, cause),
        _hard_cases,
    )
    names = list(calibration.sigmas)
    series = (Series("one sigma of S_d", names, [100 * calibration.sigmas[name] for name in names], "bars"),)
    return Found(values, "What the sigma of a modulus comes from, besides the measurement", "", "% of S_d", series)


def _model(finger: Finger, reduced: fem.ReducedFinger, cause: bool) -> dict:
    """Mesh, model, fidelities, and a field that is drawn and written."""
    built = mesh.build(finger)
    model = fem.FingerModel(finger, built)
    prices = known_prices(reduced.finger_sha256, reduced.mesh_sha256)
    parts = () if prices is None else tuple(name for name in ("hertz", "mesh", "small_strain") if getattr(prices, name))
    off = []
    for force in (0.1, 0.4, 0.9):
        hertz = fem.press(reduced, Block(0.51, 10.0), force=force * (1.0 if cause else 1.1), fidelity="hertz")
        off.append(hertz.sd / fem.press(reduced, Block(0.51, 10.0), force=force, fidelity="contact").sd - 1)
    press = fem.press(reduced, Block(0.51, 10.0), force=0.588, fidelity="contact")
    picture = imread(BytesIO(view.strain_picture(finger, reduced, press, Block(0.51, 10.0))))[..., :3]
    coloured = np.ptp(picture, axis=2) > COLOURED
    return {
        "tets": float(len(built.tets)),
        "skfem": float(type(model.space.displacement).__module__.startswith("skfem")),
        "quarter": len(model.space.mesh.tets) / len(built.tets),
        "hertz": float(np.abs(off).max()),
        "prices": float(len(parts)),
        "priced": ", ".join(part.replace("_", " ") for part in parts),
        "packages": float(sum(hasattr(papilla, name) for name in ("mesh", "fem", "calibrate", "estimators"))),
        "exported": _exported(fem.recover(model, reduced, press)),
        "gauges": float(len(press.strain)),
        "picture": float(coloured.mean()),
        "picture_size": f"{picture.shape[1]} by {picture.shape[0]}",
    }


def _hard_cases() -> dict:
    """Two quick families of `papilla verify`."""
    cases = verify(["patch", "slivers"])
    return {"hard": float(np.mean([case.passed for case in cases])), "hard_cases": len(cases)}


def _exported(field: fem.Field) -> float:
    """1 if the file of a field has the content of the field."""
    import meshio

    with TemporaryDirectory() as folder:
        path = Path(folder) / "field.vtu"
        save_field(field, path)
        back = meshio.vtu.read(str(path))
    return float(np.array_equal(back.point_data["displacement_mm"], field.displacement))


def _friction(cause: bool) -> dict:
    """A simulated swipe to and fro: tangential force with breakaways, and the same as a torque."""
    rng = np.random.default_rng(50)
    time = np.arange(8000) / 1000
    phase = np.sin(2 * np.pi * 0.25 * time + 1e-3)
    velocity = np.where(np.abs(phase) < 0.2, 0.0, 30.0 * np.sign(phase))
    force = 0.5 + 0.1 * np.sin(2 * np.pi * 0.11 * time)
    starts = np.flatnonzero((velocity != 0) & (np.append(0.0, velocity[:-1]) == 0))
    mu = np.where(velocity != 0, TRUE_MU[0], 0.0) * np.sign(velocity)
    for start in starts:
        # The force rises to the breakaway while the finger rests
        first = max(0, int(start) - 150)
        mu[first:start] = np.linspace(0, TRUE_MU[1], int(start) - first) * np.sign(velocity[start])
    drag = mu * (1.0 if cause else 0.5) * force + OFFSET_N + 1e-3 * rng.standard_normal(len(time))
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
    """The tangential force (n,) that is read from a log with a torque."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "torque.csv"
        columns = {"t_s": time, "force_N": force, "velocity_mm_s": velocity, "torque_Nmm": LEVER_MM * drag}
        write_table(path, columns)
        log = read_time_log(path, lever_mm=LEVER_MM)
    assert log.tangential_N is not None
    return log.tangential_N


def _main_job(calibration: Calibration, reduced: fem.ReducedFinger, cause: bool) -> dict:
    """Coefficients, recovered moduli on the same mesh, and the check of right and of wrong presses."""
    between = [float(np.sqrt(a * b)) for a, b in zip(DEFAULT_FORCES[30:], DEFAULT_FORCES[31:], strict=False)][::6]
    moduli = np.geomspace(0.053, 0.7, 7).tolist()
    table = cached_sweep(reduced, tuple(moduli), tuple(between), reduced.bench.specimen, STICK)
    error = np.abs(
        np.asarray(calibration.invert(table.sd_microstrain, table.force_N).modulus_MPa)
        / (table.modulus_MPa if cause else 1.1 * table.modulus_MPa)
        - 1
    )
    names = tuple(f"g{k + 1}" for k in range(table.reading.shape[1]))
    soft = table.modulus_MPa < 0.2
    right = PressLog(table.force_N[soft], table.modulus_MPa[soft], table.reading[soft], names)
    wrong = PressLog(right.force_N, (1.5 if cause else 1.0) * right.modulus_MPa, right.readings, names)
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
