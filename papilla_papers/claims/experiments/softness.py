"""2006 IV: S_d against force and modulus, equations (9) and (10), softness online, and the slow way it replaces."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from papilla import fem
from papilla.calibration import Calibration, SoftnessStatus, fit
from papilla.calibration.fitting.fit import with_compact
from papilla.calibration.fitting.job import cached_sweep
from papilla.calibration.fitting.sweep import DEFAULT_MODULI, Sweep
from papilla.calibration.published import PUBLISHED_INVERSE, SPECIMENS_MPA, exact_inverse, published_sd, rounding_error
from papilla.core.units import PER_CENT, gf_to_newton
from papilla.estimators import Doubts, GaugeSoftness, Pipeline
from papilla.identification.one_touch import fit_indentation, on_bonded_layer, on_finger, on_half_space
from papilla.model.finger import Finger
from papilla.model.specimen import STICK_WORD, Block, Friction, Specimen
from papilla.references import bonded_layer_sphere, hertz_sphere_at
from papilla_papers.claims.claim import Experiment, gathered
from papilla_papers.claims.scenes import by_factors, even, scene
from papilla_papers.claims.signals import RATE_Hz, last_number, listed, times
from papilla_papers.methods.softness import PrintedSoftness

SOFTNESS_SCENE = scene("softness")
FORCES_N = tuple(by_factors(SOFTNESS_SCENE.forces_N).tolist())
TABLE_MODULI_MPA = tuple(sorted({*DEFAULT_MODULI[::2], *SPECIMENS_MPA}))
SD_FORCES_GF = np.array(SOFTNESS_SCENE.compared_gf, float)
GAUGE_NOISE_UE: float = SOFTNESS_SCENE.gauge_noise_microstrain
SENSOR_NOISE = {"gauge_sigma": GAUGE_NOISE_UE, "force_sigma_N": SOFTNESS_SCENE.force_noise_N}


@dataclass(frozen=True)
class PressParameters:
    """Parameters that the 2006 paper does not print: response of a gauge to bending (lever over gain), thickness of the
    specimens, and friction between them and the skin."""

    lever_mm: float
    thickness_mm: float
    friction: Friction = STICK_WORD

    def sweep(self, forces_gf) -> Sweep:
        """Presses of the default finger on the three specimens."""
        reduced = with_lever(fem.prepare(Finger.default()), self.lever_mm)
        forces = gf_to_newton(np.array(forces_gf, float))
        return sweep(reduced, SPECIMENS_MPA, forces, partial(Block, thickness=self.thickness_mm), self.friction)


ASSUMED_PRESS = PressParameters(**SOFTNESS_SCENE.assumed)


def run(tell, cause: bool = True) -> dict:
    """S_d against force and modulus, equations (9) and (10) offline and online, and the modulus from force and depth.

    The calibration is fitted to presses of 0.05-1 N on moduli of 0.02-5 MPa; presses on another mesh are recovered by
    the refitted quadratic, by the surface, and online with noise of 5 microstrain and 1 mN. The slow baseline fits the
    modulus to force and indentation: of presses on another mesh, of a noisy Hertzian curve, and of a bonded layer.
    """
    tell("calibration")
    reduced, second_mesh = fem.prepare(Finger.default()), other_finger()
    table = sweep(reduced, TABLE_MODULI_MPA, FORCES_N)
    calibration = calibrated(reduced)
    tell("presses on another mesh")
    presses = sweep(second_mesh, SPECIMENS_MPA, gf_to_newton(np.array(SOFTNESS_SCENE.forces_gf)))
    return gathered(
        lambda: {"specimens": float(sum(modulus in TABLE_MODULI_MPA for modulus in SPECIMENS_MPA))},
        lambda: _against_9(ASSUMED_PRESS, cause),
        lambda: _published(calibration, cause),
        lambda: _inverses(calibration, presses),
        lambda: _on_three(ASSUMED_PRESS, cause),
        lambda: _online(calibration, presses, cause),
        lambda: _by_regression(calibration, second_mesh, cause),
        lambda: _slow(table, second_mesh, cause),
        lambda: _together(calibration, cause),
    )


def other_finger() -> fem.ReducedFinger:
    """The default finger on another mesh."""
    return fem.prepare(Finger.default(), variant=SOFTNESS_SCENE.other_mesh)


def calibrated(reduced: fem.ReducedFinger) -> Calibration:
    """A calibration of the default finger from a table of half the usual density, with scatter of another mesh."""
    second_mesh = sweep(other_finger(), TABLE_MODULI_MPA, FORCES_N[:: SOFTNESS_SCENE.forces_N.other_mesh])
    return with_compact(fit(sweep(reduced, TABLE_MODULI_MPA, FORCES_N), [second_mesh], strain=SOFTNESS_SCENE.strain))


def sweep(
    reduced: fem.ReducedFinger,
    moduli,
    forces,
    block: Callable[[float], Specimen] | None = None,
    friction: Friction = STICK_WORD,
) -> Sweep:
    """Presses with large strain, kept in the cache: by default they stick, as silicone does on silicone, on the
    bench's blocks."""
    ordered = [tuple(sorted(float(value) for value in values)) for values in (moduli, forces)]
    return cached_sweep(reduced, ordered[0], ordered[1], block or reduced.bench.specimen, friction)


def with_lever(reduced: fem.ReducedFinger, lever_mm: float) -> fem.ReducedFinger:
    """The finger with gauges that read strain + lever x curvature."""
    return replace(reduced, weights=np.array([reduced.weights[0], np.full_like(reduced.weights[0], lever_mm)]))


def by_force(table: Sweep) -> np.ndarray:
    """S_d (forces, moduli) of a sweep."""
    order = np.lexsort((table.modulus_MPa, table.force_N))
    return table.sd_microstrain[order].reshape(-1, len(np.unique(table.modulus_MPa)))


def scaled_to_9(sd: np.ndarray, first: int = 0) -> tuple[float, float]:
    """The factor that brings S_d (`SD_FORCES_GF`, specimens) closest to (9) from a force on, and the
    remaining rms in %."""
    theirs, ours = published_sd(SD_FORCES_GF[:, None], np.array(SPECIMENS_MPA))[first:], sd[first:]
    scale = float((ours * theirs).sum() / (ours**2).sum())
    return scale, PER_CENT * float(np.sqrt(np.mean((scale * ours - theirs) ** 2) / np.mean(theirs**2)))


def _against_9(assumed: PressParameters, cause: bool = True) -> dict:
    """S_d of the three specimens compared with (9); without its cause all three are equal."""
    sd = by_force(assumed.sweep(SD_FORCES_GF))
    (scale, rms), (_, heavy) = (scaled_to_9(sd, first) for first in (0, SOFTNESS_SCENE.heavy))
    sd = sd if cause else np.repeat(sd[:, 1:2], sd.shape[1], axis=1)
    return {
        "scale": scale,
        "rms_9": rms,
        "rms_9_30": heavy,
        "ordered": float(np.mean((np.diff(sd, axis=1) > 0).all(axis=1))),
        "low_ratio": float(sd[-1, 0] / sd[-1, 1]),
        "high_ratio": float(sd[-1, 2] / sd[-1, 1]),
    }


def _published(calibration: Calibration, cause: bool) -> dict:
    """S_d of the calibration over the modulus, its refit of (9), and (10) against (9)."""
    many = by_factors(SOFTNESS_SCENE.many.modulus_MPa)
    moduli = many if cause else np.full_like(many, SPECIMENS_MPA[1])
    along = calibration.predict(gf_to_newton(SOFTNESS_SCENE.many.force_gf), moduli)
    four_digits = exact_inverse(SOFTNESS_SCENE.many.published_digits)
    cost, four = (rounding_error(inverse) for inverse in (PUBLISHED_INVERSE, four_digits))
    return {
        "rises": float(np.mean(np.diff(along) > 0)),
        "refit": listed(calibration.forward.coefficients, ".4g"),
        "digits_cost": abs(cost.largest_MPa),
        "digits_rms": cost.rms_MPa,
        "four": abs(four.largest_MPa),
    }


def _inverses(calibration: Calibration, presses: Sweep) -> dict:
    """Errors of the refitted quadratic, the surface and the compact form for presses on another mesh."""
    force, modulus, sd = presses.force_N, presses.modulus_MPa, presses.sd_microstrain
    quadratic = calibration.inverse(sd, np.array(force) / gf_to_newton(1.0)) / modulus - 1
    surface = np.asarray(calibration.invert(sd, force).modulus_MPa) / modulus - 1
    answered = np.abs(quadratic[np.isfinite(quadratic)])
    form = calibration.compact
    assert form is not None
    ends = form.force_N, SOFTNESS_SCENE.grid.modulus_MPa
    axes = [np.geomspace(low, high, SOFTNESS_SCENE.grid.count) for low, high in ends]
    grid_f, grid_e = (axis.ravel() for axis in np.meshgrid(*axes))
    on_grid = calibration.inverse(calibration.predict(grid_f, grid_e), grid_f / gf_to_newton(1.0)) / grid_e - 1
    return {
        "refused": int((~np.isfinite(quadratic)).sum()),
        "pressed": len(sd),
        "quadratic_least": float(answered.min()) if answered.size else float("nan"),
        "quadratic_worst": float(answered.max()) if answered.size else float("nan"),
        "surface_worst": float(np.nanmax(np.abs(surface))),
        "compact_rms": form.rms,
        "quadratic_rms": float(np.sqrt(np.nanmean(on_grid**2))),
    }


def _on_three(assumed: PressParameters, cause: bool = True) -> dict:
    """(9) refitted as the paper poses it, on the three specimens over 60-100 gf, and its inverse of presses between."""
    refit, between = fit(assumed.sweep(SOFTNESS_SCENE.three_gf)), assumed.sweep(SOFTNESS_SCENE.between_gf)
    stated = between.modulus_MPa if cause else np.roll(between.modulus_MPa, len(SOFTNESS_SCENE.between_gf))
    errors = refit.inverse(between.sd_microstrain, between.force_N / gf_to_newton(1.0)) / stated - 1
    answered = np.isfinite(errors)
    return {
        "three_worst": float(np.abs(errors[answered]).max()) if answered.all() else float("inf"),
        "three_answered": float(answered.mean()),
        "three_largest": float(np.abs(errors[answered]).max()) if answered.any() else float("nan"),
        "three_range": "none"
        if refit.inverse.modulus_MPa is None
        else "{:.3f}-{:.3f}".format(*refit.inverse.modulus_MPa),
    }


def _online(calibration: Calibration, presses: Sweep, cause: bool) -> dict:
    """The published form and the gauges' estimator, sample by sample."""
    rows = np.column_stack([presses.reading, presses.force_N])
    estimate = PrintedSoftness(calibration, form="quadratic", gauge_sigma=GAUGE_NOISE_UE).process(rows)
    by_hand = np.asarray(calibration.inverse(presses.sd_microstrain, presses.force_N / gf_to_newton(1.0)))
    modulus, sigma = np.asarray(estimate.modulus_MPa), np.asarray(estimate.modulus_sigma_MPa)
    both = np.isfinite(modulus)
    inside = np.abs(modulus - presses.modulus_MPa)[both] <= 2 * sigma[both]
    hand = SOFTNESS_SCENE.by_hand
    sd, force = hand.sd, hand.force_gf
    printed = PrintedSoftness(form="printed", scale=1.0, gauges=2).update((-sd, sd, gf_to_newton(force)))
    square, slope, constant = hand.of_force
    exact = np.sqrt(hand.of_sd * sd + square * force**2 + slope * force + constant) - hand.shift_MPa
    setup, words, ratios = SOFTNESS_SCENE.gauges, [], []
    rng = np.random.default_rng(setup.seed)
    _, last_N = setup.forces_N
    tried = (SOFTNESS_SCENE.softest_MPa, *SPECIMENS_MPA)
    for stated, pressed in zip(tried, tried if cause else tried[::-1], strict=True):
        press = sweep(other_finger(), [pressed], setup.forces_N).reading[1]
        noisy = press + GAUGE_NOISE_UE * rng.standard_normal((setup.samples, len(press)))
        block = np.column_stack([noisy, last_N + SOFTNESS_SCENE.force_noise_N * rng.standard_normal(setup.samples)])
        gauges = GaugeSoftness(calibration, **SENSOR_NOISE, doubts=Doubts.NONE)
        answer = gauges.process(block)
        last, spread = float(np.asarray(answer.modulus_MPa)[-1]), float(np.asarray(answer.modulus_sigma_MPa)[-1])
        status = SoftnessStatus(int(np.asarray(answer.status)[-1]))
        words.append(f"{last:.4f} ± {spread:.4f} for {stated:g} ({status.sentence.split(':')[0]})")
        if status == SoftnessStatus.OK:
            ratios.append(last / stated)
    return {
        "online_is_formula": abs(float(printed.modulus_MPa) / exact - 1),
        "online_uses": float(np.mean(np.isclose(modulus, by_hand, rtol=1e-9, equal_nan=True))),
        "online_ok": float(np.mean(np.asarray(estimate.status) == SoftnessStatus.OK)),
        "online_inside": float(inside.mean()) if inside.size else 0.0,
        "gauge_each": ", ".join(words),
        "gauges_worst": max(ratios, key=lambda ratio: abs(np.log(ratio))) if ratios else float("nan"),
    }


def _by_regression(calibration: Calibration, second_mesh: fem.ReducedFinger, cause: bool) -> dict:
    """The modulus of the three specimens, sample by sample, by the regression that follows presses."""
    presses = sweep(second_mesh, SPECIMENS_MPA, gf_to_newton(np.array(SOFTNESS_SCENE.online_gf)))
    rng = np.random.default_rng(SOFTNESS_SCENE.regression.seed)
    noisy = presses.reading + GAUGE_NOISE_UE * rng.standard_normal(presses.reading.shape)
    estimator = PrintedSoftness(calibration, form="compact", **SENSOR_NOISE)
    estimate = estimator.process(np.column_stack([noisy, presses.force_N]))
    stated = presses.modulus_MPa if cause else SPECIMENS_MPA[0] * SPECIMENS_MPA[-1] / presses.modulus_MPa
    off, sigma = np.asarray(estimate.modulus_MPa) / stated - 1, np.asarray(estimate.modulus_sigma_MPa) / stated
    ok = np.asarray(estimate.status) == SoftnessStatus.OK
    worst = [float(np.abs(off[presses.modulus_MPa == modulus]).max()) for modulus in SPECIMENS_MPA]
    return {
        "regression_worst": max(worst) if ok.all() else float("inf"),
        "regression_each": ", ".join(
            f"{error:.0%} at {modulus:g} MPa" for error, modulus in zip(worst, SPECIMENS_MPA, strict=True)
        ),
        "regression_inside": float(np.mean(np.abs(off) <= 2 * sigma)),
    }


def _slow(table: Sweep, second_mesh: fem.ReducedFinger, cause: bool) -> dict:
    """Modulus from force and indentation: on the finger of another mesh, on a thick specimen, on a layer."""
    errors, words = [], []
    model, slow = on_finger(table), (SPECIMENS_MPA[0], SOFTNESS_SCENE.slow.soft_MPa, SPECIMENS_MPA[1])
    series = sweep(second_mesh, slow, even(SOFTNESS_SCENE.slow.force_N))
    for stated, pressed in zip(slow, slow if cause else slow[::-1], strict=True):
        rows = series.modulus_MPa == pressed
        fitted = fit_indentation(series.force_N[rows], series.indentation_mm[rows] + SOFTNESS_SCENE.slow.zero_mm, model)
        errors.append(fitted.modulus_MPa / stated - 1)
        words.append(f"{fitted.modulus_MPa:.4f} ± {fitted.sigma_MPa:.4f} for {stated:.4f} MPa")
    sold, layer = SOFTNESS_SCENE.vendor, SOFTNESS_SCENE.layer
    rng, depth, radius = np.random.default_rng(sold.seed), even(sold.depth_mm), sold.radius_mm
    e_star = (sold.modulus_MPa if cause else sold.without_cause_MPa) / (1 - 0.5**2)
    force = np.array([hertz_sphere_at(depth_mm, radius, e_star).force if depth_mm > 0 else 0.0 for depth_mm in depth])
    noisy = force + sold.noise_share * force.max() * rng.standard_normal(len(force))
    beyond, some = depth > sold.from_mm, depth[layer.every :: layer.every]
    vendor = fit_indentation(noisy[beyond], depth[beyond] + sold.zero_mm, on_half_space(radius))
    shape = layer.radius_mm, layer.thickness_mm
    layered = [bonded_layer_sphere(float(depth_mm), *shape, layer.modulus_MPa).force for depth_mm in some]
    shallow = fit_indentation(layered, some, on_half_space(layer.radius_mm))
    right = fit_indentation(layered, some, on_bonded_layer(*shape, layer.exponent))
    return {
        "slow_error": PER_CENT * float(np.abs(errors).max()),
        "slow_each": ", ".join(words),
        "vendor_error": PER_CENT * abs(vendor.modulus_MPa / sold.modulus_MPa - 1),
        "vendor": f"{vendor.modulus_MPa:.4f} ± {vendor.sigma_MPa:.4f} MPa, contact at {vendor.offset_mm:.4f} mm",
        "hertz_on_layer": shallow.modulus_MPa / layer.modulus_MPa - 1,
        "layer": right.modulus_MPa / layer.modulus_MPa - 1,
    }


def _together(calibration: Calibration, cause: bool) -> dict:
    """One stream with a press, a grating and friction in it."""
    stream, truth = SOFTNESS_SCENE.together, SOFTNESS_SCENE.together.truth
    time, rng = times(stream.seconds), np.random.default_rng(stream.seed)
    velocity = stream.speed_mm_s * np.sign(np.sin(2 * np.pi * stream.strokes_Hz * time + stream.phase))
    force = stream.force_N + stream.swell_N * np.sin(2 * np.pi * stream.swell_Hz * time)
    grating = np.sin(2 * np.pi * np.cumsum(velocity) / RATE_Hz / truth.wavelength_mm)
    pressed = calibration.predict_readings(force, truth.modulus_MPa if cause else stream.without_cause_MPa)
    readings = pressed + stream.grating_microstrain * grating[:, None] + rng.standard_normal(pressed.shape)
    noise = SOFTNESS_SCENE.force_noise_N * rng.standard_normal(len(time))
    drag = truth.mu_kinetic * force * np.sign(velocity) + stream.offset_N + noise
    block = np.column_stack([time, readings, force, velocity, drag])
    pipeline = Pipeline(calibration, columns=("force_N", "velocity_mm_s", "tangential_N"), doubts=Doubts.NONE)
    answers = pipeline.process(block)
    last = {name: last_number(getattr(answers, name)) for name in truth}
    right = [abs(last[name] / true - 1) < stream.within for name, true in truth.items()]
    words = ", ".join(f"{name} {last[name]:.4g} for {true:g}" for name, true in truth.items())
    return {"together": float(sum(right)), "row": words}


experiment = Experiment.of(run, ASSUMED_PRESS, high_ratio=_against_9, rms_9=_against_9, three_worst=_on_three)
