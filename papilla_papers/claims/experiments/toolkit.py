"""Properties of papilla itself: calibration from finite elements, pictures, cost, hard cases, friction."""

from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.image import imread

import papilla
from papilla import fem, mesh, view
from papilla.calibration import Calibration, check
from papilla.calibration.fitting.job import cached_sweep
from papilla.calibration.fitting.sweep import DEFAULT_FORCES, DEFAULT_MODULI, SPECIMENS_MPA
from papilla.core.tables import write_table
from papilla.core.units import PER_CENT
from papilla.estimators import Friction
from papilla.fem.fields import save_field
from papilla.fem.pressing.prices import known_prices
from papilla.logs import PressLog, read_time_log
from papilla.model.finger import Finger
from papilla.model.specimen import STICK_WORD, Block
from papilla.verify import verify
from papilla_papers.claims.claim import Experiment, gathered
from papilla_papers.claims.experiments.softness import calibrated
from papilla_papers.claims.scenes import by_factors, scene
from papilla_papers.claims.signals import RATE_Hz, last_number, listed, times

TOOLKIT_SCENE = scene("toolkit")


def run(tell, cause: bool = True) -> dict:
    """What papilla is for: calibration, pictures, prices, hard cases, friction.

    The default finger is calibrated and its presses between the table's points are recovered; a strain field is drawn
    and written; two families of `papilla verify` run. Friction comes from a simulated swipe to and fro with breakaways.
    """
    finger = Finger.default()
    tell("calibration")
    reduced = fem.prepare(finger)
    calibration = calibrated(reduced)
    tell("mesh, model and hard cases")
    return gathered(
        lambda: _friction(cause),
        lambda: _main_job(calibration, reduced, cause),
        lambda: _model(finger, reduced, cause),
        _hard_cases,
    )


def _model(finger: Finger, reduced: fem.ReducedFinger, cause: bool) -> dict:
    """Mesh, model, fidelities, and a field that is drawn and written."""
    built = mesh.build(finger)
    model = fem.FingerModel(finger, built)
    prices = known_prices(reduced.finger_sha256, reduced.mesh_sha256)
    parts = () if prices is None else tuple(name for name in ("hertz", "mesh", "small_strain") if getattr(prices, name))
    setup, off = TOOLKIT_SCENE.model, []
    block = Block(TOOLKIT_SCENE.modulus_MPa, TOOLKIT_SCENE.thickness_mm)
    wrong = 1.0 if cause else setup.without_cause
    for force in setup.forces_N:
        hertz = fem.press(reduced, block, force=force * wrong, fidelity="hertz")
        off.append(hertz.sd / fem.press(reduced, block, force=force, fidelity="contact").sd - 1)
    press = fem.press(reduced, block, force=setup.force_N, fidelity="contact")
    red_green_blue = slice(None, -1)  # The last channel is opacity
    picture = imread(BytesIO(view.strain_picture(finger, reduced, press, block)))[..., red_green_blue]
    coloured = np.ptp(picture, axis=2) > setup.coloured
    return {
        "tets": float(len(built.tets)),
        "skfem": float(type(model.space.displacement).__module__.startswith("skfem")),
        "quarter": len(model.space.mesh.tets) / len(built.tets),
        "hertz": float(np.abs(off).max()),
        "prices": float(len(parts)),
        "priced": ", ".join(fidelity.replace("_", " ") for fidelity in parts),
        "packages": float(sum(hasattr(papilla, name) for name in ("mesh", "fem", "calibrate", "estimators"))),
        "exported": _exported(fem.recover(model, reduced, press)),
        "gauges": float(len(press.strain)),
        "picture": float(coloured.mean()),
        "picture_size": f"{picture.shape[1]} by {picture.shape[0]}",
    }


def _hard_cases() -> dict:
    """Two quick families of `papilla verify`."""
    cases = verify([*TOOLKIT_SCENE.model.families])
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
    swipe, time = TOOLKIT_SCENE.swipe, times(TOOLKIT_SCENE.swipe.seconds)
    rng = np.random.default_rng(swipe.seed)
    phase = np.sin(2 * np.pi * swipe.strokes_Hz * time + swipe.phase)
    velocity = np.where(np.abs(phase) < swipe.rests_below, 0.0, swipe.speed_mm_s * np.sign(phase))
    force = swipe.force_N + swipe.swell_N * np.sin(2 * np.pi * swipe.swell_Hz * time)
    starts = np.flatnonzero((velocity != 0) & (np.append(0.0, velocity[:-1]) == 0))
    mu = np.where(velocity != 0, swipe.mu_kinetic, 0.0) * np.sign(velocity)
    for start in starts:
        # The force rises to the breakaway while the finger rests
        first = max(0, int(start) - swipe.rise_samples)
        mu[first:start] = np.linspace(0, swipe.mu_static, int(start) - first) * np.sign(velocity[start])
    drag = mu * (1.0 if cause else swipe.without_cause) * force + swipe.offset_N
    drag = drag + swipe.noise_N * rng.standard_normal(len(time))
    last = {}
    for name, tangential in (("force", drag), ("torque", _by_torque(time, force, velocity, drag))):
        estimate = Friction(sample_rate_Hz=float(RATE_Hz)).process(np.column_stack([tangential, force, velocity]))
        for key in ("mu_kinetic", "mu_static"):
            last[name, key] = last_number(getattr(estimate, key))
    mu_torque = last["torque", "mu_kinetic"]
    return {key: last["force", key] for key in ("mu_kinetic", "mu_static")} | {"mu_torque": mu_torque}


def _by_torque(time, force, velocity, drag) -> np.ndarray:
    """The tangential force (n,) that is read from a log with a torque."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "torque.csv"
        torque = TOOLKIT_SCENE.swipe.lever_mm * drag
        columns = {"t_s": time, "force_N": force, "velocity_mm_s": velocity, "torque_Nmm": torque}
        write_table(path, columns)
        log = read_time_log(path, lever_mm=TOOLKIT_SCENE.swipe.lever_mm)
    assert log.tangential_N is not None
    return log.tangential_N


def _main_job(calibration: Calibration, reduced: fem.ReducedFinger, cause: bool) -> dict:
    """Coefficients, recovered moduli on the same mesh, and the check of right and of wrong presses."""
    setup = TOOLKIT_SCENE.job
    forces = np.array(DEFAULT_FORCES[setup.first_force :])
    between, moduli = np.sqrt(forces[:-1] * forces[1:])[:: setup.every], by_factors(setup.modulus_MPa)
    table = cached_sweep(reduced, tuple(moduli.tolist()), tuple(between.tolist()), reduced.bench.specimen, STICK_WORD)
    answer = np.asarray(calibration.invert(table.sd_microstrain, table.force_N).modulus_MPa)
    error = np.abs(answer / (table.modulus_MPa if cause else setup.without_cause * table.modulus_MPa) - 1)
    names = tuple(f"g{k + 1}" for k in range(table.reading.shape[1]))
    soft = table.modulus_MPa < setup.soft_MPa
    right = PressLog(table.force_N[soft], table.modulus_MPa[soft], table.reading[soft], names)
    wrong = PressLog(right.force_N, (setup.wrong if cause else 1.0) * right.modulus_MPa, right.readings, names)
    of_right, of_wrong = check(calibration, right), check(calibration, wrong)
    ends = calibration.inverse.modulus_MPa or SPECIMENS_MPA[:2]
    force, modulus = np.meshgrid(setup.forces_gf, np.linspace(*ends, setup.moduli))
    inner = modulus * (1 - setup.towards_mean) + setup.towards_mean * modulus.mean()
    back = calibration.inverse(calibration.forward(force, inner), force)
    return {
        "coefficients": float(len(calibration.forward.coefficients)),
        "refit": listed(calibration.forward.coefficients, ".4g"),
        "moduli": float(len(DEFAULT_MODULI)),
        "inverse_exact": float(np.abs(back / inner - 1).max()),
        "own_mesh": float(np.max(error)),
        "own_count": len(error),
        "passed": len(of_right.presses) - of_right.missed,
        "presses": len(of_right.presses),
        "wrong": of_wrong.missed,
        "checked": float(
            of_right.passed and not of_wrong.passed and of_wrong.missed > setup.missed * len(of_wrong.presses)
        ),
        "strain_named": float("large strain" in calibration.sigmas),
        "sigmas": ", ".join(f"{name} {PER_CENT * value:.2f} %" for name, value in calibration.sigmas.items()),
    }


experiment = Experiment.of(run)
