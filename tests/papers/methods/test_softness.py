"""Equation (10) online: as printed, exact, refitted; its sigma, and what it refuses."""

import math
from dataclasses import replace

import numpy as np
import pytest

from papilla.calibration import SoftnessStatus
from papilla.calibration.published import SPECIMENS_MPA, published_sd
from papilla.calibration.readouts import Compact
from papilla.core.errors import InputError
from papilla.core.units import gf_to_newton
from papilla.estimators import Pipeline
from papilla_papers.methods.softness import PrintedSoftness

PATTERN = np.array([-1.0, 1.0, -1.0, 1.0])
FIVE = np.array([-1.0, 1.0, 0.0, -1.0, 1.0]) / math.sqrt(0.8)
"""Readings of population standard deviation 1, of four gauges and of five."""


def sample(sd: float, force_gf: float) -> list[float]:
    """Four readings whose population standard deviation is `sd`, and the force in N."""
    return [*(3.0 + sd * PATTERN).tolist(), gf_to_newton(force_gf)]


def one(form: str, **options) -> PrintedSoftness:
    return PrintedSoftness(form=form, scale=1.0, gauges=4, **options)


@pytest.mark.parametrize("force", [10.0, 50.0, 100.0])
@pytest.mark.parametrize("modulus", SPECIMENS_MPA)
def test_the_exact_inverse_gives_back_what_equation_9_was_given(force, modulus):
    found = one("exact").update(sample(published_sd(force, modulus), force))
    assert found.status == SoftnessStatus.OK and found.modulus_MPa == pytest.approx(modulus, abs=1e-9)


def test_the_printed_digits_cost_what_they_are_known_to_cost_and_the_scale_is_the_unit_of_the_readings():
    found = one("printed").update(sample(published_sd(100.0, 0.089), 100.0))
    assert found.modulus_MPa - 0.089 == pytest.approx(0.044, abs=0.003)
    scaled = PrintedSoftness(form="exact", scale=0.05, gauges=4).update(sample(published_sd(50.0, 0.51) / 0.05, 50.0))
    assert scaled.modulus_MPa == pytest.approx(0.51, abs=1e-9)


def test_the_scale_and_the_misfit_of_a_calibration_are_those_of_the_best_factor(calibration):
    force, moduli = np.arange(10, 101, 10), np.array(SPECIMENS_MPA)
    ours = np.array([calibration.predict(gf_to_newton(force), modulus) for modulus in moduli]).T
    theirs = published_sd(force[:, None], moduli[None, :])
    own = PrintedSoftness(calibration, form="exact")
    left = [np.sqrt(np.mean((factor * own.scale * ours - theirs) ** 2)) for factor in (0.98, 1.0, 1.02)]
    assert own.misfit == pytest.approx(left[1], rel=1e-6) and 0 < own.misfit < 0.5 * theirs.mean()
    assert own.misfit < 1.01 * min(left), "no other factor is much closer"


def test_sigma_is_what_noise_of_gauges_and_force_scatters():
    rng, noise, force_noise = np.random.default_rng(2), 4.0, gf_to_newton(0.2)
    estimator = one("exact", gauge_sigma=noise, force_sigma_N=force_noise)
    base = np.array(sample(published_sd(60.0, 0.51), 60.0))
    rows = base + np.column_stack([rng.normal(0, noise, (4000, 4)), rng.normal(0, force_noise, 4000)])
    found = estimator.process(rows)
    good = found.status == SoftnessStatus.OK
    assert good.mean() > 0.99
    # S_d's noise is that of a mean square of four readings about their mean: their own in each direction of S_d
    stated = float(np.median(found.modulus_sigma_MPa))
    assert np.std(found.modulus_MPa[good]) == pytest.approx(stated, rel=0.1)


def test_the_refitted_form_is_the_calibrations_inverse_with_its_misfit(calibration):
    force, modulus = 30.0, 0.3
    readings = float(calibration.forward(force, modulus)) * FIVE
    found = PrintedSoftness(calibration, form="quadratic").update([*readings, gf_to_newton(force)])
    assert found.modulus_MPa == pytest.approx(modulus, rel=1e-9)
    slope = 2 * -9000 * modulus + 12000
    assert found.modulus_sigma_MPa == pytest.approx(calibration.forward.rms / slope, rel=1e-9)


def test_the_compact_form_answers_by_sample_what_the_calibrations_own_does(calibration):
    form = Compact(np.array([7.0, 0.5, -0.05, -3.0, 0.2]), (0.1, 1.0), (0.05, 0.72), 0.04, 0.1, 0.01)
    estimator = PrintedSoftness(replace(calibration, compact=form), form="compact", gauge_sigma=3.0)
    for force, modulus in ((0.1, 0.06), (0.4, 0.089), (1.0, 0.3), (0.6, 0.8)):
        sd = float(form.predict(force, modulus))
        found = estimator.update([*(sd * FIVE), force])
        assert found.status == SoftnessStatus.OK and found.modulus_MPa == pytest.approx(modulus, rel=1e-9)
        if modulus < form.modulus_MPa[1]:
            assert found.modulus_sigma_MPa == pytest.approx(form.invert(sd, force, 3.0 / math.sqrt(5))[1], rel=1e-9)
    for modulus, status in ((0.01, SoftnessStatus.SOFTER), (5.0, SoftnessStatus.HARDER)):
        found = estimator.update([*(float(form.predict(0.4, modulus)) * FIVE), 0.4])
        assert found.status == status and math.isnan(found.modulus_MPa)
    assert estimator.update([*FIVE, 1.1]).status == SoftnessStatus.FORCE_ABOVE
    with pytest.raises(InputError, match="has no compact form"):
        PrintedSoftness(replace(calibration, compact=None), form="compact")


@pytest.mark.parametrize(
    "row, status",
    [
        (sample(published_sd(50.0, 0.03), 50.0), SoftnessStatus.SOFTER),
        (sample(published_sd(50.0, 2.0), 50.0), SoftnessStatus.HARDER),
        (sample(1.0, 50.0), SoftnessStatus.SOFTER),
        (sample(500.0, 3.0), SoftnessStatus.FORCE_BELOW),
        (sample(500.0, 120.0), SoftnessStatus.FORCE_ABOVE),
        (sample(500.0, 0.5), SoftnessStatus.NO_CONTACT),
        ([math.nan, *sample(500.0, 50.0)[1:]], SoftnessStatus.BAD_GAUGE),
        ([*sample(500.0, 50.0)[:-1], math.inf], SoftnessStatus.BAD_INPUT),
    ],
)
def test_what_it_refuses_has_a_reason_and_no_number(row, status):
    found = one("exact").update(row)
    assert found.status == status and math.isnan(found.modulus_MPa) and found.sentence != "ok"
    little = one("exact", force_sigma_N=0.1).update(sample(published_sd(50.0, 0.089), 50.0))
    assert little.status == SoftnessStatus.NOT_IDENTIFIABLE and little.modulus_sigma_MPa > 0.5 * little.modulus_MPa


@pytest.mark.parametrize(
    "options, message",
    [
        ({"form": "cubic"}, "form must be printed, exact, quadratic or compact, got 'cubic'"),
        ({"form": "printed"}, "without a calibration"),
        ({"form": "quadratic", "scale": 1.0, "gauges": 4}, "without a calibration"),
        ({"scale": 1.0, "gauges": 1}, "gauges must be at least 2"),
        ({"scale": -1.0, "gauges": 4}, "scale must be greater than 0"),
    ],
)
def test_unusable_options_are_refused_and_the_pipeline_knows_the_forms(options, message, calibration):
    with pytest.raises(InputError, match=message):
        PrintedSoftness(**options)
    pipeline = Pipeline(calibration, columns=("force_N",), softness="quadratic")
    assert any("by the published form" in message for message in pipeline.notes)


@pytest.mark.parametrize("form", ["printed", "exact"])
def test_sigma_is_the_root_of_the_squares_of_what_each_error_changes(form):
    """By differences of the modulus: noise over the root of the number of gauges, the force's, and no misfit."""
    force, sd = 40.0, float(published_sd(40.0, 0.3))
    at = [
        one(form).update(sample(sd + a, force + b)).modulus_MPa for a, b in ((0.5, 0), (-0.5, 0), (0, 0.01), (0, -0.01))
    ]
    expected = math.hypot((at[0] - at[1]) * 3.0 / 2.0, (at[2] - at[3]) / 0.02 * 0.7)
    answer = one(form, gauge_sigma=3.0, force_sigma_N=gf_to_newton(0.7)).update(sample(sd, force))
    assert answer.modulus_sigma_MPa == pytest.approx(expected, rel=1e-3)


def test_limits_of_force_and_modulus_are_those_of_the_printed_specimens(calibration):
    """5 to 100 gf; from half of the softest specimen to one and a half of the hardest; contact from 0.02 N."""
    for force, status in ((4.99, "FORCE_BELOW"), (5.0, "OK"), (100.0, "OK"), (100.01, "FORCE_ABOVE")):
        assert one("exact").update(sample(float(published_sd(force, 0.3)), force)).status == SoftnessStatus[status]
    for modulus, status in ((0.0446, "OK"), (0.0444, "SOFTER")):
        assert one("exact").update(sample(float(published_sd(60.0, modulus)), 60.0)).status == SoftnessStatus[status]
    for force_N, status in ((0.0199, "NO_CONTACT"), (0.0201, "FORCE_BELOW")):
        assert one("exact").update([*(9 * PATTERN), force_N]).status == SoftnessStatus[status]
    assert one("exact", contact_force_N=0.3).update([*(9 * PATTERN), 0.29]).status == SoftnessStatus.NO_CONTACT
    assert (
        PrintedSoftness(calibration, gauges=5).columns[-1] == "force_N"
        and len(PrintedSoftness(calibration).columns) == 6
    )
    for options in ({"gauges": 4}, {"form": "quadratic", "scale": 1.0}):
        with pytest.raises(InputError):
            PrintedSoftness(calibration, **options)
    assert PrintedSoftness(scale=1.0, gauges=2).update((-300.0, 300.0, 0.5)).status in iter(SoftnessStatus)
