"""Fits, doubts, profiles and suggestions on a response by power laws: both edges of each limit, and formulas written
out."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from power_law_presses import FINGER, GAUGES, Powers, problem, with_sd

from papilla.fem.pressing.off_apex import MoveLimits
from papilla.identification import Diagnosis, Noise, diagnosis, fit, record, suggest
from papilla.identification import page as identification_page
from papilla.identification.fit import Identification, solve
from papilla.identification.presses import Known, Shape
from papilla.model.specimen import Block, Sphere

QUIET = Noise(readings_microstrain=0.01, force=1e-5, indentation_mm=1e-5, model=1e-5, depth=1e-5)


@pytest.fixture(scope="module")
def found():
    """A finger identified from eight presses with hardly any noise."""
    made = problem(force=np.geomspace(0.1, 0.9, 8), response=Powers(error=1e-5))
    noise = 0.01 * np.random.default_rng(0).normal(size=(8, 3))
    return solve(replace(made, noise=QUIET, log=replace(made.log, readings=made.log.readings + noise)))


def varied(found, sigma=None, correlation=0.0, **changes):
    """The identification with other standard deviations by name, and a correlation of both moduli."""
    size = np.full(len(found.names), 1e-4)
    for name, value in (sigma or {}).items():
        size[found.names.index(name)] = value
    together = np.eye(len(size))
    together[0, 1] = together[1, 0] = correlation
    return replace(found, covariance=together * np.outer(size, size), **changes)


def said(doubts, part):
    return any(part in one for one in doubts)


def test_a_fit_returns_the_finger_its_covariance_and_its_chi_square(found):
    truth = {"outer_modulus_MPa": FINGER.outer.modulus, "gain.g2": -0.5, "lever_mm.g3": 0.05, "touch_down_mm": 0.15}
    for name, value in truth.items():
        assert found[name][0] == pytest.approx(value, rel=0.02), name
    jacobian, residuals = found.problem.jacobian(found.vector), found.problem.residuals(found.vector)
    inner = np.linalg.inv(jacobian[:-1].T @ jacobian[:-1])
    assert found.covariance == pytest.approx(inner, rel=1e-4) and found.chi_square < 1.5 * found.freedom
    priors = len(found.names) + 1
    assert found.chi_square == pytest.approx((residuals[:-priors] ** 2).sum())
    used = np.trace(inner @ (jacobian[:-priors].T @ jacobian[:-priors]))
    assert found.freedom == pytest.approx(32 - used) and 8 < used < len(found.names)
    shown = found.finger
    assert shown.gauges[1].membrane_gain == found.values["gain.g2"]
    lever = found.values["lever_mm.g2"] - 0.2 * found.values["gain.g2"]
    assert shown.gauges[1].lever_mm == pytest.approx(lever)
    assert found.residuals == pytest.approx(found.problem.measured - found.problem.modelled(found.vector).values)
    assert found.at(np.array([0.2]), np.array([0.5])).shape == (1, 4)


@pytest.mark.parametrize("excess, widened", [(1.4, 1.0), (1.6, 1.6)])
def test_sigmas_are_widened_above_a_misfit_of_one_and_a_half(found, excess, widened):
    weights = found.problem.weights * np.sqrt(excess * found.freedom / found.chi_square)
    scaled = replace(found.problem, weights=weights)
    again = fit._judged(scaled, found.vector, None)
    assert again.chi_square == pytest.approx(excess * found.freedom)
    excess = again.chi_square / again.freedom
    plain = fit._covariance(scaled, found.vector)
    assert again.covariance == pytest.approx(plain * (excess if widened > 1 else 1.0))


def test_fits_start_at_the_design_and_one_prior_sigma_to_both_sides():
    made = problem(free=("outer_modulus_MPa", "inner_modulus_MPa", "common_gain", "gain.g1"))
    middle = made.start[:3]
    starts = np.array(fit.starts_of(made)) - middle
    assert starts == pytest.approx(0.7 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]))


@pytest.mark.parametrize("share, named", [(0.9e-3, True), (1.1e-3, False)])
@pytest.mark.parametrize("end", [0, 1])
def test_a_parameter_is_at_its_bound_within_a_thousandth_of_the_range(found, share, named, end):
    made, vector = found.problem, found.problem.start.copy()
    low, high = made.bounds
    assert diagnosis.at_bounds(made, vector) == []
    vector[0] = (low[0] + share * (high - low)[0]) if end == 0 else high[0] - share * (high - low)[0]
    vector[1] = vector[0] - 1.0
    assert ("outer_modulus_MPa" in diagnosis.at_bounds(made, vector)) == named
    vector[1] = vector[0] + 0.1
    assert diagnosis.RATIO in diagnosis.at_bounds(made, vector)


@pytest.mark.parametrize(
    "changes, part",
    [
        ({"sigma": {"outer_modulus_MPa": (0.50, 0.48)}}, "do not determine outer_modulus_MPa: its prior decides"),
        ({"correlation": (0.951, 0.949)}, "outer_modulus_MPa and inner_modulus_MPa are determined together only (corr"),
        ({"correlation": (-0.951, -0.949)}, "determined together only (correlation -0.951)"),
        ({"rival": (3.84, 3.85)}, "another finger fits as well, chi-square only 3.8 more"),
        ({"chi_square": (15.1, 14.9), "freedom": (10.0, 10.0)}, "the model does not fit: chi-square is 1.51 times its"),
    ],
)
def test_a_doubt_about_the_fit_begins_at_its_limit(monkeypatch, found, changes, part):
    monkeypatch.setattr(diagnosis, "_swapped", lambda found: [])
    for which, doubted in ((0, True), (1, False)):
        sigma = {name: pair[which] for name, pair in changes.get("sigma", {}).items()}
        rest = {name: pair[which] for name, pair in changes.items() if name != "sigma"}
        assert said(diagnosis._of_the_fit(varied(found, sigma, **rest), ()), part) == doubted
    bounded = diagnosis.Profile("outer_modulus_MPa", 0.1, 0.2, "bounded")
    wide = varied(found, {"outer_modulus_MPa": 0.6})
    assert said(diagnosis._of_the_fit(wide, (bounded,)), "its prior decides")
    assert not said(diagnosis._of_the_fit(wide, (replace(bounded, verdict="flat"),)), "its prior decides")


@pytest.mark.parametrize("pull, doubted", [(1.95, False), (1.97, True), (-1.95, False), (-1.97, True)])
def test_a_specimen_far_from_its_stated_modulus_is_named(found, pull, doubted):
    name = "specimen_modulus.0.3"
    held = {**found.problem.held, name: 0.3}
    made = replace(found.problem, specimens={name: Known(0.1, np.array([1, 4]))}, free=(*found.names, name), held=held)
    vector = np.append(found.vector, np.log(0.3) + 0.1 * pull)
    other = Identification(made, vector, np.eye(len(vector)) * 1e-8, 1.0, 20.0)
    assert said(diagnosis._of_the_fit(other, ()), "the specimen of 0.3 MPa came out at") == doubted
    assert made.moduli(made.values(vector))[[0, 1, 4]] == pytest.approx([0.1, *[0.3 * np.exp(0.1 * pull)] * 2])
    assert made.priors[name] == (np.log(0.3), 0.1)


def test_doubts_about_gauges_begin_at_their_limits(found):
    noise, made = replace(QUIET, readings_microstrain=5.0), found.problem
    for swing, dead in ((19.9, True), (20.1, False)):
        readings = made.log.readings.copy()
        readings[:, 2] = np.linspace(0.0, swing, 8)
        other = replace(found, problem=replace(made, noise=noise, log=replace(made.log, readings=readings)))
        assert said(diagnosis._of_gauges(other), "g3 hardly follows the presses") == dead
    limit = 0.7 * 0.87 * found.problem.gains[1]
    for sigma, open_ in ((1.01 * limit, True), (0.99 * limit, False)):
        told = diagnosis._of_gauges(varied(found, {"lever_mm.g2": sigma}))
        assert said(told, "do not separate lever and gain of g2: the prior decides") == open_
    for sigma, backwards in ((0.5 / 1.95, False), (0.5 / 1.97, True)):
        assert bool(diagnosis._backwards(varied(found, {"gain.g2": sigma}))) == backwards
    assert diagnosis._of_gauges(replace(found, problem=with_sd(found.problem))) == []


def test_the_choice_of_presses_is_doubted_by_what_it_leaves_open(found):
    made = found.problem
    assert diagnosis._of_the_presses(found) == []
    log = made.log
    one = replace(found, problem=replace(made, log=replace(log, modulus_MPa=np.full(8, 0.3))))
    assert said(diagnosis._of_the_presses(one), "all presses are on one modulus")
    same = replace(one, problem=replace(one.problem, log=replace(one.problem.log, force_N=np.full(8, 0.3))))
    assert said(diagnosis._of_the_presses(same), "one and the same scene")
    alone = with_sd(made)
    assert said(diagnosis._of_the_presses(replace(found, problem=alone, vector=alone.start)), "S_d alone: ratios")
    middle = float(np.sqrt(log.force_N[2] * log.force_N[3])) / found.values["inner_modulus_MPa"]
    shape = replace(made.shapes[0], responses=(Powers(strained=middle, most=middle, large_strain=False),))
    told = diagnosis._of_the_presses(replace(found, problem=replace(made, shapes=(shape,))))
    assert told[0].startswith("5 of 8 presses strain this finger more") and len(told) == 3
    assert told[1].startswith("5 of 8 presses lie outside") and told[2].startswith("large strain is not known")


@pytest.mark.parametrize(
    "chi_square, freedom, least, swapped",
    [(30.0, 20.0, 16.1, True), (30.0, 20.0, 16.3, False), (13.8, 20.0, 0.0, False), (60.0, 10.0, 30.0, False),
     (60.0, 10.0, 25.0, True), (30.0, 0.0, 16.1, False)],
)  # fmt: skip
def test_gauges_look_swapped_if_chi_square_falls_by_twice_ln_1000(
    monkeypatch, found, chi_square, freedom, least, swapped
):
    seen = []

    def descend(made, start):
        seen.append(made)
        crossed = np.allclose(made.log.readings, found.problem.log.readings[:, [2, 1, 0]])
        return (least if crossed else 50.0), made.start

    monkeypatch.setattr(diagnosis, "descend", descend)
    told = diagnosis._swapped(replace(found, chi_square=chi_square, freedom=freedom))
    assert said(told, f"g1 and g3 look swapped: chi-square would be {least:.3g} instead of") == swapped == bool(told)
    assert len(seen) == (6 if chi_square >= 2 * np.log(1000) else 0)


def test_a_diagnosis_has_profiles_of_what_is_poorly_determined_and_normal_intervals_of_the_rest(monkeypatch, found):
    monkeypatch.setattr(diagnosis, "profile", lambda found, name: diagnosis.Profile(name, 0.1, 0.9, "bounded"))
    moved = {"outer_modulus_MPa": np.array([0.1, 0.2, 0.3]), "touch_down_mm": np.array([0.0, 1.01, 0.1])}
    monkeypatch.setattr(diagnosis, "influence_by_parameter", lambda found: moved)
    one = varied(found, {"outer_modulus_MPa": 0.151, "inner_modulus_MPa": 0.149, "gain.g1": 9.0}, chi_square=5.0)
    told = diagnosis.diagnose(one)
    assert [each.name for each in told.profiles] == ["outer_modulus_MPa"]
    assert told.intervals["outer_modulus_MPa"] == (0.1, 0.9)
    inner = one.values["inner_modulus_MPa"]
    assert told.intervals["inner_modulus_MPa"] == pytest.approx(inner * np.exp(np.array([-1, 1]) * 1.959964 * 0.149))
    assert told.intervals["gain.g1"] == pytest.approx(one.values["gain.g1"] + np.array([-1, 1]) * 1.959964 * 9)
    assert said(told.doubts, "press 2 alone moves touch_down_mm by about 1 of its") and told.status.startswith(
        "doubtful, but 1"
    )
    assert told.status.endswith(f"identified from 8 presses, chi-square 5 at {one.freedom:.3g} degrees of freedom")
    moved["touch_down_mm"][1] = 0.99
    quiet = diagnosis.diagnose(varied(found, chi_square=5.0))
    assert quiet.status.startswith("ok, but 1 of 3 gauges read backwards") and len(quiet.doubts) == 1


def test_a_record_has_what_gauges_share_as_each_gauges_own(found):
    made = replace(found.problem, free=("outer_modulus_MPa", "common_gain", "common_lever_mm"))
    vector = np.array([np.log(0.2), np.log(1.5), -0.3])
    covariance = np.array([[4.0, 1.0, 0.5], [1.0, 9.0, -1.0], [0.5, -1.0, 2.0]]) * 1e-4
    one = Identification(made, vector, covariance, 12.0, 9.0)
    kept = record(one, Diagnosis("ok", (), {"outer_modulus_MPa": (0.1, 0.4)}, (), np.zeros(8), 1.0), "a block")
    gain, lever = 1.5 * -0.5, 1.5 * 0.3 + 1.5 * -0.5 * -0.3
    values, places = dict(zip(kept.parameters, kept.values, strict=True)), kept.parameters.index
    assert len(kept.parameters) == 7 and values["gain.g2"] == pytest.approx(gain)
    assert values["lever_mm.g2"] == pytest.approx(lever) and values["outer_modulus_MPa"] == pytest.approx(0.2)
    assert kept.logarithmic[0] and not any(kept.logarithmic[1:])
    # gain and lever have these derivatives by (ln outer modulus, ln common gain, common lever)
    slopes = np.array([[1.0, 0, 0], [0, gain, 0], [0, lever, gain]])
    rows = [0, places("gain.g2"), places("lever_mm.g2")]
    found_covariance = np.array(kept.covariance)[np.ix_(rows, rows)]
    assert found_covariance == pytest.approx(slopes @ covariance @ slopes.T)
    half = 1.959964 * np.sqrt(found_covariance[2, 2])
    assert (kept.lower[rows[2]], kept.upper[rows[2]]) == pytest.approx((lever - half, lever + half))
    assert (kept.lower[0], kept.upper[0], kept.presses, kept.specimen) == (0.1, 0.4, 8, "a block")
    assert kept.zeros_microstrain == pytest.approx((0.0, 7.0, 0.0)) and kept.touch_down_mm == 0.15
    assert kept.friction == "stick" and one.with_record(kept).bench.friction == "stick"


def drawn_profile(monkeypatch, found, cost, excess=1.0, at_bound=None):
    """The profile of the outer modulus where the presses' chi-square is a function of ln of it, less the design's."""
    name, middle = "outer_modulus_MPa", float(found.problem.start[0])

    def descend(rest, start):
        value, vector = np.log(rest.held[name]) - middle, rest.start.copy()
        if at_bound is not None and value > at_bound:
            vector[0] = rest.bounds[1][0]
        return cost(value), vector

    monkeypatch.setattr(diagnosis, "descend", descend)
    vector = found.problem.start.copy()
    one = replace(varied(found, {name: 0.3}), vector=vector, chi_square=excess * 10, freedom=10.0)
    told = diagnosis.profile(one, name)
    return told, np.log([told.lower, told.upper]) - middle


@pytest.mark.parametrize("excess, level", [(1.0, 3.84146), (1.4, 3.84146), (1.6, 1.6 * 3.84146)])
def test_a_profile_of_a_parabola_is_a_normal_interval(monkeypatch, found, excess, level):
    told, ends = drawn_profile(monkeypatch, found, lambda value: (value / 0.3) ** 2, excess)
    half = np.sqrt(level / (1 / 0.3**2 + 1 / 0.7**2))
    assert ends == pytest.approx([-half, half], abs=0.01) and told.verdict == "bounded" and told.cut_off_by == ()


@pytest.mark.parametrize(
    "cost, verdict, reach",
    [
        (lambda value: 0.0, "flat", (-1.372, 1.372)),
        (lambda value: 100 * max(value, 0.0) ** 2, "one-sided", (-1.372, 0.194)),
        (lambda value: 100 * min(value, 0.0) ** 2, "one-sided", (-0.194, 1.372)),
        (lambda value: 2 * value**2, "bounded", (-0.974, 0.974)),
        (lambda value: 1.4 * value**2, "flat", (-1.056, 1.056)),
    ],
)
def test_what_presses_leave_open_ends_where_the_prior_does(monkeypatch, found, cost, verdict, reach):
    """The prior is 0.7 wide; at its bounds, 1.6, the presses alone have to rise by 3.84."""
    told, ends = drawn_profile(monkeypatch, found, cost)
    assert told.verdict == verdict and ends == pytest.approx(reach, abs=0.01)


def test_a_profile_that_another_parameter_cuts_off_names_it(monkeypatch, found):
    told, _ = drawn_profile(monkeypatch, found, lambda value: 0.0, at_bound=1.0)
    assert told.cut_off_by == ("inner_modulus_MPa",)


def moving(found):
    """The identification with contacts that may move 5 mm, and a skin that rolls 30 and 20 mm per radian."""
    limits = SimpleNamespace(limits=MoveLimits(5.0, 3.0, np.array([30.0, 20.0])))
    shapes = tuple(replace(shape, off_apex=limits) for shape in found.problem.shapes)
    return replace(found, problem=replace(found.problem, shapes=shapes))


def test_places_and_tilts_that_the_presses_could_determine_are_candidates(found):
    made = moving(found).problem
    every = ["row_along_mm", "row_across_mm", *(f"place_mm.{name}" for name in GAUGES), "tilt_x_deg", "tilt_y_deg"]
    assert fit._candidates(made, ()) == every
    assert fit._candidates(made, ("row_along_mm", "tilt_x_deg")) == [*every[1:5], "tilt_y_deg"]
    # 3 degrees on 30 mm take 1.57 of 5 mm, on 20 mm 1.05
    far = replace(made, log=replace(made.log, x_mm=np.full(8, 3.5), y_mm=np.full(8, 3.5)))
    assert fit._candidates(far, ()) == every[:6]
    ball = replace(made, shapes=(Shape(made.shapes[0].rows, Sphere(1.0, 5.0), made.shapes[0].responses, (),
                                       made.shapes[0].off_apex),))  # fmt: skip
    assert fit._candidates(ball, ()) == every[:5]


@pytest.mark.parametrize(
    "costs, freed, words",
    [
        ({"row_along_mm": 25.0, "tilt_x_deg": 28.0, "place_mm.g1": 60.0}, ("row_along_mm",),
         "row_along_mm (+0.5 mm) was freed because the presses do not fit otherwise: chi-square fell from 100 to 25; "
         "tilt_x_deg instead of row_along_mm does as well"),
        ({"row_along_mm": 25.0, "tilt_x_deg": 28.9, "place_mm.g1": 60.0}, ("row_along_mm",),
         "chi-square fell from 100 to 25"),
        ({"row_along_mm": 71.0, "tilt_x_deg": 80.0, "place_mm.g1": 90.0}, (), ""),
        ({"row_along_mm": 31.0, "tilt_x_deg": 60.0, "place_mm.g1": 60.0}, (), ""),
        ({"row_along_mm": 69.0, "tilt_x_deg": 29.0, "place_mm.g1": 90.0}, ("tilt_x_deg",), "tilt_x_deg (+0.5 deg)"),
    ],
)  # fmt: skip
def test_a_parameter_is_freed_if_chi_square_falls_by_a_third_and_the_model_then_fits(
    monkeypatch, found, costs, freed, words
):
    gains = {"row_along_mm": 50.0, "tilt_x_deg": 40.0, "place_mm.g1": 30.0, "tilt_y_deg": 20.0}
    tried = []

    def with_free(one, name):
        tried.append(name)
        size = len(one.names) + 1
        made = replace(one.problem, free=(*one.names, name))
        cost = costs[name] if len(one.names) == len(found.names) else 0.99 * one.chi_square
        return replace(one, problem=made, vector=np.append(one.vector, 0.5), covariance=np.eye(size), chi_square=cost)

    monkeypatch.setattr(fit, "_moving", lambda made, size_mm, progress: made)
    monkeypatch.setattr(fit, "_candidates", lambda made, held: [n for n in gains if n not in held])
    monkeypatch.setattr(fit, "_gain", lambda one, name: gains[name])
    monkeypatch.setattr(fit, "_with_free", with_free)
    bad = replace(found, chi_square=100.0, freedom=20.0)
    best = fit.freed(bad, (), None, None)
    assert best.names[len(found.names) :] == freed and tried[:3] == ["row_along_mm", "tilt_x_deg", "place_mm.g1"]
    assert best.asked.endswith(words) if freed and "(+" not in words else words in best.asked
    assert (best is bad) == (not freed)


@pytest.mark.parametrize("chi_square, freedom, misfit", [(15.1, 10.0, True), (14.9, 10.0, False), (9.0, 0.0, False)])
def test_only_a_misfit_frees_parameters(monkeypatch, found, chi_square, freedom, misfit):
    asked = []
    monkeypatch.setattr(fit, "_moving", lambda made, size_mm, progress: asked.append(1) or made)
    monkeypatch.setattr(fit, "_candidates", lambda made, held: [])
    one = replace(found, chi_square=chi_square, freedom=freedom)
    assert fit.freed(one, (), None, None) is one and bool(asked) == misfit
    asked.clear()
    alone = replace(one, problem=with_sd(found.problem), chi_square=99.0, freedom=1.0)
    assert fit.freed(alone, (), None, None) is alone and not asked, "S_d alone frees nothing"


@dataclass(frozen=True)
class Linear:
    """A linear problem of which `free` are the first columns."""

    columns: np.ndarray
    off: np.ndarray
    free: tuple[str, ...]

    def linearised(self, vector):
        jacobian = self.columns[:, : len(self.free)]
        return jacobian @ vector - self.off, jacobian


def test_the_gain_of_a_parameter_is_the_fall_of_chi_square_of_a_linear_fit():
    rng = np.random.default_rng(0)
    made = Linear(rng.normal(size=(9, 3)), rng.normal(size=9), ("a", "b"))
    costs = [np.linalg.lstsq(made.columns[:, :k], made.off)[1][0] for k in (2, 3)]
    vector = np.linalg.lstsq(made.columns[:, :2], made.off)[0]
    one = Identification(made, vector, np.eye(2), costs[0], 7.0)
    assert fit._gain(one, "c") == pytest.approx(costs[0] - costs[1])
    silent = replace(made, columns=made.columns * [1.0, 1.0, 0.0])
    assert fit._gain(replace(one, problem=silent), "c") == 0.0


def test_the_page_of_an_identification_has_its_numbers(monkeypatch, found):
    drawn = {}
    plots = identification_page.view.plots
    monkeypatch.setattr(identification_page, "image", lambda picture, words: (picture, words))
    monkeypatch.setattr(plots, "sd_of_presses", lambda *parts: drawn.setdefault("curves", parts))
    monkeypatch.setattr(plots, "residuals_against_force", lambda *parts: drawn.setdefault("residuals", parts))
    one = varied(found, {"outer_modulus_MPa": 0.2, "inner_modulus_MPa": 0.1}, 0.93)
    intervals = {name: (1.0, 2.0) for name in one.names}
    told = Diagnosis("ok", (), intervals, (), np.array([0.1, 0.5, 0.3, 0, 0, 0, 0, 0]), 1.0)
    page = identification_page.parts(one, told)
    assert page["physics"] == found.problem.shapes[0].physics and page["diagnosis"] is told
    assert page["held"].startswith("row_along_mm, row_across_mm, place_mm, tilt_x_deg") and "gain" in page["held"]
    rows = {name: (interval, unit) for name, _, interval, unit in page["parameters"]}
    assert rows["outer_modulus_MPa"] == ("1.000 to 2.000", "MPa") and rows["thickness_mm"] == ("held", "mm")
    assert rows["common_lever_mm"] == ("held", "mm") and "tilt_x_deg" not in rows and "common_gain" not in rows
    assert [row[0] for row in page["influential"]][:3] == ["2", "3", "1"] and len(page["influential"]) == 8
    assert page["influential"][0][3] == "0.50"
    (words,) = page["correlations"]
    assert words.startswith("outer_modulus_MPa with inner_modulus_MPa ")
    assert not identification_page._correlations(varied(found, None, 0.89))
    weighted = identification_page.weighted_residuals(one)
    order = np.lexsort((one.problem.log.force_N, one.problem.log.modulus_MPa))
    for k, (name, size, relative, changes) in enumerate(page["gauges"]):
        rms = np.sqrt((one.residuals[:, k] ** 2).mean())
        assert name == GAUGES[k] and float(size.split(" ")[0]) == pytest.approx(rms, rel=0.01)
        assert float(relative) == pytest.approx(np.sqrt((weighted[:, k] ** 2).mean()), rel=0.01)
        signs = np.sign(one.residuals[order, k])
        assert changes == f"{sum(a != b for a, b in zip(signs, signs[1:], strict=False))} of 7"
    forces, moduli, curves, (force, modulus, sd, bars) = drawn["curves"]
    assert forces[[0, -1]] == pytest.approx([0.1, 0.9]) and len(forces) == 60 and moduli == [0.1, 0.3, 0.7]
    for k, stiff in enumerate(moduli):
        assert curves[:, k] == pytest.approx(one.at(forces, np.full(60, stiff))[:, :3].std(axis=1))
    zeros = [one.values[f"zero_microstrain.{name}"] for name in GAUGES]
    assert sd == pytest.approx((one.problem.log.readings - zeros).std(axis=1))
    assert bars == pytest.approx(one.problem.noise.readings_microstrain / np.sqrt(3) + one.problem.noise.force * sd)
    assert (force == one.problem.log.force_N).all() and (modulus == one.problem.log.modulus_MPa).all()
    assert drawn["residuals"][1] == GAUGES and drawn["residuals"][2] == pytest.approx(weighted[:, :3])


def test_curves_are_of_eight_moduli_at_most_and_points_of_the_first_shape_at_the_apex(monkeypatch, found):
    drawn = []
    monkeypatch.setattr(identification_page.view.plots, "sd_of_presses", lambda *parts: drawn.append(parts))
    made = found.problem
    for moduli in (np.linspace(0.1, 0.8, 8), np.linspace(0.1, 0.9, 9)):
        force = np.full(len(moduli), 0.4)
        log = replace(made.log, force_N=force, modulus_MPa=moduli, readings=np.zeros((len(moduli), 3)),
                      x_mm=np.arange(len(moduli)) % 2.0, indentation_mm=force)  # fmt: skip
        shape = replace(made.shapes[0], rows=np.arange(1, len(moduli)))
        identification_page._curves(replace(found, problem=replace(made, log=log, shapes=(shape,))))
        _, shown, _, points = drawn[-1]
        assert len(shown) == 8 and (shown[0], shown[-1]) == (moduli[0], moduli[-1])
        assert points[1] == pytest.approx(moduli[2::2])


def test_suggested_presses_reduce_what_the_finger_leaves_open_of_the_modulus(found):
    made = found.problem.jacobian(found.vector)
    known = made.T @ made
    told = suggest.suggest_presses(found, 2, (0.1, 0.5), forces=(0.2, 0.6))
    force, modulus = (axis.ravel() for axis in np.meshgrid([0.2, 0.6], [0.1, 0.5], indexing="ij"))
    one = suggest._finger(found.problem, found.vector, (force, modulus, np.zeros((4, 2))), known)
    assert one.known == pytest.approx(known)
    # S_d of the readings without zeros, at 6 forces and 6 moduli of the published domain
    forces, moduli = np.meshgrid(np.geomspace(0.196133, 0.980665, 6), np.geomspace(0.05, 0.72, 6))
    zeros = [found.values[f"zero_microstrain.{name}"] for name in GAUGES]

    def ln_sd(vector, factor=1.0):
        values = found.problem.of(forces.ravel(), factor * moduli.ravel()).modelled(vector).values[:, :3]
        return np.log((values - zeros).std(axis=1))

    by_modulus = np.abs(ln_sd(found.vector, np.exp(1e-5)) - ln_sd(found.vector, np.exp(-1e-5))) / 2e-5
    for k in range(len(found.names)):
        step = 1e-5 * (np.arange(len(found.names)) == k)
        slope = (ln_sd(found.vector + step) - ln_sd(found.vector - step)) / 2e-5
        assert one.slope[:, k] == pytest.approx(slope / np.maximum(by_modulus, 0.02), rel=1e-3, abs=1e-5)
    rows = [int(np.flatnonzero((force == f) & (modulus == e))[0]) for f, e in
            zip(told.force_N, told.modulus_MPa, strict=True)]  # fmt: skip
    for spread, more in ((told.sigma_before, 0.0), (told.sigma_after, one.each[rows].sum(axis=0))):
        variance = np.einsum("mf,fg,mg->m", one.slope, np.linalg.inv(known + more), one.slope)
        assert spread == pytest.approx(np.sqrt(variance.mean()), rel=1e-6)
    assert told.sigma_after < told.sigma_before and told.criterion == "I" and told.place_mm == ((0.0, 0.0),) * 2
    # What a press tells are its weighted derivatives
    pressed = suggest._pressed(found.problem, found.vector, (force, modulus, np.zeros((4, 2))))
    assert pressed.log.readings == pytest.approx(pressed.modelled(found.vector).values[:, :3])
    slopes = pressed.jacobian(found.vector)[4 * 2 : 4 * 3]
    assert one.each[2] == pytest.approx(slopes.T @ slopes)


def test_a_protocol_from_nothing_is_for_fingers_of_the_prior(monkeypatch):
    asked = []

    def shapes_of(log, touched, *rest):
        asked.append(touched)
        return (Shape(np.arange(len(log)), touched, (Powers(),)),)

    monkeypatch.setattr(suggest, "shapes_of", shapes_of)
    candidates = (np.array([0.2, 0.5]), np.array([0.1, 0.4]), np.zeros((2, 2)))
    made, vectors = suggest._from_nothing(FINGER, candidates, None, QUIET, 3, None)
    assert asked == [FINGER.bench.specimen(1.0)] and len(vectors) == 12 and made.noise is QUIET
    values = [made.values(vector) for vector in vectors]
    inner = np.array([one["inner_modulus_MPa"] for one in values]) / FINGER.inner.modulus
    ratio = np.array([one["outer_modulus_MPa"] for one in values]) / FINGER.outer.modulus / inner
    gain = np.array([[one[f"gain.{name}"] for name in GAUGES] for one in values])
    lever = np.array([[one[f"lever_mm.{name}"] for name in GAUGES] for one in values]) / gain
    for part, low, high in ((inner, 0.5, 2.0), (ratio, 0.5, 2.0), (gain, 0.02, 1.0), (lever, -2.0, 1.0)):
        assert low <= part.min() < part.max() <= high and part.max() - part.min() > 0.4 * (high - low)
    again = suggest._from_nothing(FINGER, candidates, Block(1.0, 7.0), QUIET, 4, None)[1]
    assert asked[-1] == Block(1.0, 7.0) and not np.allclose(vectors[0], again[0])
    told = suggest._finger(made, vectors[0], candidates, None)
    assert told.known.shape == (len(made.free),) * 2 and np.linalg.eigvalsh(told.known).min() >= 0
    gain_row = made.free.index("gain.g1")
    assert told.known[0, 0] == pytest.approx(1 / 0.7**2) and told.known[gain_row, gain_row] >= 1 / 2.0**2
