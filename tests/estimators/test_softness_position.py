"""Five gauges and a contact that may lie beside the apex: bound, domain, bad channels, state."""

import math
from dataclasses import replace

import numpy as np
import pytest

from papilla.calibration import BicubicSurface, GaugeSurface, SoftnessStatus, Uncertainty
from papilla.calibration.fitting.position_terms import fit_positions
from papilla.core.errors import InputError
from papilla.estimators import Doubts, GaugeSoftness, Pipeline
from papilla.estimators.health import Fault, unpack
from papilla.estimators.softness.channels import GaugeSurfaces
from papilla.estimators.softness.fitter import Fitter

FORCE, MODULUS, CELLS, REACH = (0.05, 1.0), (0.02, 5.0), (12, 24), 4.0
GAUGES_MM = np.array([-13.0, -7.0, 0.0, 7.0, 13.0])
PRESS = 0.2 + 0.7 * np.sin(np.linspace(0.05, 3, 100)) ** 2
SHORT = PRESS[::2]
OK, LEFT_OUT, MISFIT, OFF_REACH = (int(SoftnessStatus[name]) for name in ("OK", "LEFT_OUT", "MISFIT", "OFF_REACH"))


def seen(force, modulus, x):
    """(..., g) readings per newton, alike the default finger's: the middle gauge feels the modulus, all feel x."""
    force, modulus, x = (np.asarray(value, float)[..., None] for value in (force, modulus, x))
    soft = 1 / (1 + (modulus / 0.1) * force**-0.2)
    away = (x - GAUGES_MM) / 5
    near = 140e3 * (force / 0.3) ** -0.4 * (1 - 0.35 * soft) * np.exp(-(away**2))
    return near - 46e3 * (force / 0.3) ** -0.1 * np.exp(-((away / 3) ** 2))


@pytest.fixture(scope="module")
def build(make):
    """build(error) -> a calibration with contact positions whose gauges and positions have that relative error."""
    force, modulus = (np.geomspace(*limits, count) for limits, count in ((FORCE, 40), (MODULUS, 60)))
    axes = [BicubicSurface(FORCE, MODULUS, np.ones([cells + 3 for cells in CELLS]))]
    left, right = axes[0].force_axis.basis(force), axes[0].modulus_axis.basis(modulus)
    values = seen(force[:, None], modulus[None, :], 0.0)
    fit = np.einsum("af,fmg,bm->gab", np.linalg.pinv(left), values, np.linalg.pinv(right))
    some_modulus, some_force = (part.ravel() for part in np.meshgrid(modulus[::5], force[::5]))
    some_force, some_modulus = np.append(some_force, FORCE[1]), np.append(some_modulus, MODULUS[1])
    places = np.linspace(-REACH, REACH, 17)
    reading = some_force[:, None] * seen(some_force, some_modulus, places[:, None])
    moved = {"force_N": some_force, "modulus_MPa": some_modulus, "place_mm": places, "reading": reading}
    terms = fit_positions(moved)

    def made(error=0.0):
        gauges = []
        for number, table in enumerate(fit):
            own = np.full(2, error * float(np.abs(table).mean()))
            known = Uncertainty(0.0, 1.96, 0.0, np.array(FORCE), own, 2.0, 4)
            gauges.append(GaugeSurface(f"g{number + 1}", BicubicSurface(FORCE, MODULUS, table), known))
        own = replace(terms, error=terms.error if error else 0 * terms.error)
        return replace(make(), gauges=tuple(gauges), position=own)

    return made


@pytest.fixture(scope="module")
def exact(build):
    return build()


def touched(calibration, modulus, force, x, gauge_sigma=50.0, force_sigma=0.005, seed=0):
    """(n, 6) noisy samples of a press at x (a number, or one of each sample)."""
    rng = np.random.default_rng(seed)
    readings = calibration.predict_readings(force, modulus, np.zeros_like(force) + x)
    noise = force_sigma * rng.normal(size=len(force)) if force_sigma < math.inf else np.full(len(force), np.nan)
    return np.column_stack([readings + gauge_sigma * rng.normal(size=readings.shape), force + noise])


def estimator(calibration, gauge_sigma=50.0, force_sigma=0.005, position_sigma=math.inf, **options):
    noise = {"gauge_sigma": gauge_sigma, "force_sigma_N": force_sigma, "doubts": Doubts.NONE}
    return GaugeSoftness(calibration, **noise, position_sigma_mm=position_sigma, **options)


def test_slopes_of_the_surfaces_are_their_finite_differences(exact):
    """At a point and across the edge of a cell of x."""
    surfaces, h = GaugeSurfaces(exact, True), 1e-5
    for x in (1.3, 2.0 - h / 2):
        at = math.log(0.31), math.log(0.13), x
        value, along_modulus, along_force, along_x = surfaces.at(*at)
        np.testing.assert_allclose(value, exact.predict_readings(0.31, 0.13, x), rtol=1e-12)
        for axis, found in enumerate((0.31 * along_force, along_modulus, along_x)):
            ends = [surfaces.at(*np.add(at, side * h * np.eye(3)[axis]).tolist()).reading for side in (1, -1)]
            np.testing.assert_allclose(found, (ends[0] - ends[1]) / (2 * h), rtol=1e-5, atol=0.1)


def test_without_noise_it_is_the_inverse_out_to_the_reach(exact):
    own = estimator(exact, 1e-3, 1e-7)
    for x in (-3.99, -1.2, 0.0, 0.7, 3.0):
        for modulus in (0.03, 0.3, 3.0):
            own.reset()
            answer = own.process(touched(exact, modulus, SHORT, x, 0.0, 0.0))
            assert (answer.status == OK).all()
            np.testing.assert_allclose(answer.modulus_MPa, modulus, rtol=1e-5)
            np.testing.assert_allclose(answer.position_mm, x, atol=1e-4)
            np.testing.assert_allclose(answer.force_N, SHORT, rtol=1e-4)


@pytest.mark.parametrize("x", [4.3, 5.0, 7.0, 10.0, -6.0])
def test_beyond_the_reach_there_is_no_answer(exact, x):
    """Readings there are a made-up finger's, not the extrapolated surfaces'."""
    for modulus in (0.05, 0.3):
        noise = np.random.default_rng(0).normal(size=(len(PRESS), 6)) * np.array([50.0] * 5 + [0.005])
        answer = estimator(exact).process(np.column_stack([PRESS[:, None] * seen(PRESS, modulus, x), PRESS]) + noise)
        assert not set(answer.status.tolist()) & {OK, LEFT_OUT}
        assert np.isnan(answer.modulus_MPa).all()
        if abs(x) < 5:
            assert (answer.status[-20:] == OFF_REACH).all()
            assert answer.sentence[-1] == "the contact lies beside the calibrated positions"


@pytest.mark.parametrize(
    "ln_force, place, ln_modulus, again",
    [
        (0.049, 0.0, 0.0, False), (-0.051, 0.0, 0.0, True), (0.0, 0.29, 0.0, False), (0.0, -0.31, 0.0, True),
        (0.0, 0.0, 0.2, False), (0.0, 0.0, -0.45, True),
    ],
)  # fmt: skip
def test_slopes_are_evaluated_again_after_a_step_and_not_at_every_sample(exact, ln_force, place, ln_modulus, again):
    """Of ln force by 0.05, place by 0.3 mm, ln E by 0.3."""
    fitter, rows = Fitter(GaugeSurfaces(exact, True), 50.0, 0.005, Doubts.NONE, math.inf), np.arange(6)
    node = fitter.linear(-1.0, 1.5, 0.5 * fitter.top)
    h = node.at[2] + ln_modulus * fitter.ln_modulus(node.at[2])[1]
    there = fitter.linear(-1.0 + ln_force, 1.5 + place, h)
    before = fitter.prior(1.0)._replace(node=node, anchor=h, ln_force=there.at[0], place_mm=there.at[1])
    before.mean[0] = h
    sample = there.expected / fitter.whiten
    learnt = fitter.learn(sample, rows, before, fitter.noise_fit(sample, rows, before))[1]
    assert (learnt.node is not node) == again


def faults_of(answer):
    return {channel: fault for channel, fault in enumerate(unpack(int(answer.left_out[-1]), 6)) if fault}


@pytest.mark.parametrize("x", [0.0, 1.0, 2.5])
@pytest.mark.parametrize(
    "channels, spoil, fault",
    [
        ([1], lambda gauges: 0 * gauges, Fault.STUCK), ([2], lambda gauges: -gauges, Fault.SIGN_FLIPPED),
        ([5], lambda force: np.nan * force, Fault.MISSING), ([5], lambda force: 1.3 * force, Fault.OFF_SURFACE),
        ([1, 2], lambda gauges: gauges[:, ::-1], Fault.SWAPPED),
    ],
)  # fmt: skip
def test_a_bad_channel_is_left_out_wherever_the_contact_is(exact, x, channels, spoil, fault):
    samples = touched(exact, 0.1, PRESS, x)
    samples[:, channels] = spoil(samples[:, channels])
    answer = estimator(exact).process(samples)
    assert faults_of(answer) == dict.fromkeys(channels, fault) and answer.status[-1] == LEFT_OUT
    assert abs(answer.modulus_MPa[-1] - 0.1) < 4 * answer.modulus_sigma_MPa[-1]
    assert abs(answer.position_mm[-1] - x) < 5 * answer.position_sigma_mm[-1]


def test_unusable_options_and_calibrations_are_refused(exact):
    with pytest.raises(InputError, match="this calibration has no contact positions"):
        estimator(replace(exact, position=None))
    with pytest.raises(InputError, match="another domain"):
        estimator(replace(exact, position=replace(exact.position, force_N=(0.05, 2.0))))
    few = replace(exact.position, coefficients=exact.position.coefficients[:2], error=exact.position.error[:2])
    with pytest.raises(InputError, match="at least 3 gauges are needed, the calibration has 2"):
        estimator(replace(exact, gauges=exact.gauges[:2], position=few))


def test_the_pipeline_answers_by_s_d_while_most_samples_contradict_themselves(build):
    """Over a coarse texture: the few samples that fit do so by chance, and are not to be believed."""
    calibration, rng = build(), np.random.default_rng(9)
    force = np.full(600, 0.5)
    clean = force[:, None] * seen(force, 0.3, 0.0)
    phase = 2 * np.pi * (0.06 * np.arange(600)[:, None] - GAUGES_MM) / 1.5
    bumpy = clean * (1 + 0.2 * np.sin(phase)) + rng.normal(0, 20, clean.shape)
    rows = np.column_stack([np.arange(600) / 1000, bumpy, force + rng.normal(0, 1e-3, 600)])
    pipeline = Pipeline(calibration, columns=("force_N",), gauge_sigma=20.0)
    by_sd = ["from S_d" in status for status in pipeline.process(rows).status]
    assert np.mean(by_sd[150:]) > 0.9
    kept = pipeline.state
    rows[:, 0] += 0.6
    rows[:, 1:6] = clean + rng.normal(0, 20, clean.shape)
    smooth = pipeline.process(rows)
    assert not any("from S_d" in status for status in smooth.status[400:])
    assert abs(smooth.modulus_MPa[-1] / 0.3 - 1) < 0.02
    pipeline.state = kept
    assert pipeline.process(rows[:300]).status == smooth.status[:300]
