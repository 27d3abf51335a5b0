"""The scenes, and their Cramér-Rao bound."""

import math
from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.estimators import Pipeline
from papilla.references.bounds import frequency_bound, wavelength_bound
from papilla.scenes import parts as parts
from papilla.scenes.parts import SCENE_HARMONICS, common_period, profile_amplitudes, sheared
from papilla.scenes.scenes import SCENES_BY_NAME, Part, Recipe, scene


def test_snr_and_seed():
    quiet, same, other = (scene("const", 1.2, snr_dB=10, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(quiet.readings, same.readings)
    assert not np.array_equal(quiet.readings, other.readings)
    assert np.var(quiet.readings - quiet.signal) == pytest.approx(0.1, rel=0.1)


def test_the_harsh_skin_trails_the_finger():
    """The skin is 0.3 mm behind on the way out and 0.3 mm ahead (still behind its motion) on the way back."""
    out = np.linspace(0, 10, 500)
    skin = sheared(np.concatenate([out, out[::-1]]), 0.3, 0.5)
    assert skin[499] - 10 == pytest.approx(-0.3)
    assert skin[-1] == pytest.approx(0.3, abs=1e-6)


def test_the_bound_scales_with_noise_and_is_infinite_without_motion():
    position = np.linspace(0, 10, 200)
    quiet = wavelength_bound(position, 2.0, [1, 0.3j], 0.1)
    assert wavelength_bound(position, 2.0, [1, 0.3j], 0.2) == pytest.approx(2 * quiet)
    assert wavelength_bound(np.zeros(200), 2.0, [1, 0.3j], 0.1) == math.inf
    assert wavelength_bound(10 * position, 20.0, [1, 0.3j], 0.1) == pytest.approx(quiet)


def test_the_bound_is_that_of_the_signal_s_own_derivative():
    """Information from finite differences of the scene's signal, which knows nothing of the bound's harmonics."""
    step, rows = 1e-5, slice(1000, 1200)
    made = scene("const", 1.8, seed=2)
    at = made.position_mm[rows] - made.position_mm[rows].mean()
    order = np.arange(1, SCENE_HARMONICS + 1)
    present = made.frequency_Hz[rows, None] * order < 400

    def signal(wavelength):
        waves = np.exp(-2j * math.pi * at[:, None] * order / wavelength) * present
        return waves, np.real(waves @ profile_amplitudes(1.8))

    waves = signal(1.8)[0][:, present.all(axis=0)]
    slope = (signal(1.8 + step)[1] - signal(1.8 - step)[1]) / (2 * step)
    others = np.column_stack([waves.real, waves.imag, np.ones(at.size)])
    rest = slope - others @ np.linalg.lstsq(others, slope, rcond=None)[0]
    expected = made.noise_sd / np.linalg.norm(rest) / 1.8
    bound = wavelength_bound(at, 1.8, profile_amplitudes(1.8), made.noise_sd, present)
    assert bound == pytest.approx(expected, rel=1e-6)


def test_the_bound_of_a_scene_is_that_of_its_windows():
    """At a constant speed all windows are alike; four gauges halve it, and a longer path lowers it by its cube."""
    made = scene("const", 1.8, seed=2)
    rows = slice(2000, 2500)
    present = made.frequency_Hz[rows, None] * np.arange(1, SCENE_HARMONICS + 1) < 0.4 * made.sample_rate_Hz
    one = wavelength_bound(made.position_mm[rows], 1.8, profile_amplitudes(1.8), made.noise_sd, present)
    assert made.bound(0.5) == pytest.approx(one, rel=0.02)
    assert made.bound(path_mm=0.5 * made.velocity_mm_s[0]) == pytest.approx(one, rel=0.02)
    four = scene("const", 1.8, seed=2, gauge_positions_mm=(0.0, 1.0, 2.0, 3.0))
    assert four.bound(0.5) == pytest.approx(one / 2, rel=0.02)
    assert made.bound(1.0) == pytest.approx(one / 2**1.5, rel=0.02)


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda: scene("walk", 1.0), "scene must be one of const; act1; act2; harsh; .*, got 'walk'"),
        (lambda: scene("const", 0.0), "wavelength"),
        (lambda: scene("const", 1.0, seconds=2).bound(3.0), "does not fit"),
        (lambda: wavelength_bound(np.zeros((2, 2)), 1.0, [1], 1.0), "shapes do not fit"),
        (lambda: frequency_bound([0, 1], [0, 1], 1.0, [1], 1.0, degree=-1), "degree"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(InputError, match=message):
        call()


# ---- Parts by themselves


@pytest.fixture
def draft():
    """A second at 1 kHz and 100 mm/s, with a texture of 1 on two gauges 0.3 mm apart."""
    made = parts.Draft(np.random.default_rng(5), False, 1000.0, np.arange(1000) / 1000, np.array([0.0, 0.3]), 1.2)
    parts.constant(made, 100.0, 0.0)
    made.texture = np.ones((1000, 2))
    return made


def test_strokes_and_turns_go_to_and_fro(draft):
    parts.strokes(draft, 80.0, 2.0)
    assert np.abs(draft.velocity).max() == pytest.approx(80, rel=1e-3)
    assert np.gradient(draft.position, 1e-3)[1:-1] == pytest.approx(draft.velocity[1:-1], abs=0.1)
    assert draft.position[[0, 500]] == pytest.approx([0, 0], abs=1e-9)
    parts.turning(draft, 0.25, 90.0, 0.1)
    assert draft.velocity.max() == 90 and draft.velocity.min() == -90
    assert (np.abs(draft.velocity) < 90 - 1e-9).mean() == pytest.approx(0.2, abs=0.02), "half a turn at each end"
    assert np.diff(draft.position) * 1000 == pytest.approx((draft.velocity[1:] + draft.velocity[:-1]) / 2)


def test_the_amplifier_passes_harmonics_below_its_band(draft):
    """At 100 mm/s over 1.25 mm four harmonics are below 400 Hz; at 400 mm/s only the first is."""
    draft.asked_mm = 1.25
    for speed, present in ((100.0, [1, 2, 3, 4]), (400.0, [1])):
        parts.constant(draft, speed, 0.0)
        parts.grating(draft)
        waves = np.exp(2j * np.pi * np.outer(np.arange(1, 6), draft.position) / 1.25)
        found = waves @ draft.texture / 1000
        assert (np.flatnonzero(np.abs(found[:, 0]) > 1e-6) + 1).tolist() == present, speed
        assert found[0, 1] / found[0, 0] == pytest.approx(np.exp(-2j * np.pi * 0.3 / 1.25))


SINE_50_HZ = {"rms": 1.5, "frequency_Hz": 50.0, "phase": 0.3}


@pytest.mark.parametrize(
    "part, options, expected",
    [
        ("motor", SINE_50_HZ, lambda t: 1.5 * 2**0.5 * np.sin(100 * np.pi * t + 0.3)),
        ("ripple", {"size": 6.0, "wavelength_mm": 20.0}, lambda t: 6 * np.sin(2 * np.pi * 100 * t / 20)),
        ("drift", {"rate_Hz": 0.5, "phase": 0.2, "size": 2.0}, lambda t: 2 * np.sin(np.pi * t + 0.2)),
        ("friction", {"size": 3.0, "turn_mm_s": 100.0}, lambda t: np.full(t.size, 3 * math.tanh(1))),
    ],
)
def test_what_is_added_has_its_size_and_phase(draft, part, options, expected):
    getattr(parts, part)(draft, **options)
    assert draft.added == pytest.approx(expected(draft.time_s), abs=1e-9) and (draft.texture == 1).all()


def test_texture_fades_and_contact_is_lost(draft):
    parts.fading(draft, 0.5, 0.0, 0.4)
    assert draft.texture[:, 1] == pytest.approx(1 + 0.4 * np.sin(np.pi * draft.time_s))
    draft.texture = np.ones((1000, 2))
    parts.lost(draft, 0.1, 0.5, 0.2, 8.0, 0.004)
    air = (draft.time_s + 0.1) % 0.5 < 0.2
    edge = np.abs(np.diff(air.astype(float), prepend=air[0])) > 0
    settled = np.convolve(edge, np.ones(41), "same") == 0
    assert np.abs(draft.texture[settled & air]).max() < 1e-3 and np.abs(draft.added[settled & air]).max() < 1e-2
    assert draft.texture[settled & ~air] == pytest.approx(1, abs=1e-3) and settled.mean() > 0.8
    assert draft.added[settled & ~air] == pytest.approx(8, abs=1e-2)


def test_spikes_steps_and_a_slow_force(draft):
    parts.spikes(draft, 0.05, 20.0)
    assert set(np.unique(draft.added)) == {-20.0, 0.0, 20.0} and 0.02 < (draft.added != 0).mean() < 0.1
    draft.added[:] = 0
    parts.steps(draft, 0.5, 0.2, (1.5, 4.0), 0.02)
    levels = draft.added[[150, 500, 900]]
    assert levels[0] == 0 and (np.abs(np.diff(levels)) >= 1.5).all() and (np.abs(np.diff(levels)) <= 4).all()
    assert draft.added[210] == pytest.approx(levels[1] / 2) and (draft.added[225:700] == levels[1]).all()
    draft.added[:] = 0
    parts.force(draft, 6.0, 0.3, 0.1, 0.1)
    waver = draft.added / 6
    assert waver.std() == pytest.approx(1) and np.abs(np.diff(waver)).max() < 0.05
    assert draft.texture[:, 0] == pytest.approx(np.maximum(1 + 0.3 * waver, 0.1))


def test_a_grating_without_its_fundamental_is_as_long_as_two_harmonics_need(draft):
    """At 100 mm/s the third harmonic of 0.765 mm is 2 % below 400 Hz."""
    draft.asked_mm = 0.5
    parts.grating(draft, missing=1)
    assert draft.wavelength[0] == pytest.approx(0.765)
    waves = np.abs(np.exp(2j * np.pi * np.outer(np.arange(1, 4), draft.position) / 0.765) @ draft.texture[:, 0]) / 1000
    assert waves[0] < 0.02 < 0.1 < waves[1:].min()


def test_a_drawn_scale_is_off_by_two_thirds_of_its_error_at_least_to_either_side(draft):
    draft.drawn, off = True, []
    for _ in range(200):
        draft.known = draft.velocity
        parts.scaled(draft, 3.0)
        off.append(draft.known[0] / 100 - 1)
    assert np.abs(off).min() == pytest.approx(0.02, rel=0.05) and np.abs(off).max() == pytest.approx(0.03, rel=0.05)
    assert 0.3 < np.mean(np.array(off) > 0) < 0.7


def test_a_rough_surface_is_one_surface_for_all_gauges_and_averaged_by_the_skin(draft):
    parts.rough(draft, 0.1, 1.0, 0.02, 1.0, 10.0)
    assert draft.texture.std() == pytest.approx(1) and np.isnan(draft.wavelength).all()
    assert draft.texture[-100:, 0].std() > 0.1, "to the end of the path"
    assert draft.texture[:-3, 1] == pytest.approx(draft.texture[3:, 0], abs=1e-6), "0.3 mm are 3 samples"
    power = np.abs(np.fft.rfft(draft.texture[:, 0] * np.hanning(1000))) ** 2
    assert power[400:].mean() < 1e-3 * power[5:50].mean(), "waves of 0.25 mm, and of 2 to 20 mm"


def test_a_hand_swings_and_a_surface_sticks_and_slips(draft):
    parts.hand(draft, 2.0, 0.0, 3.0, 0.0, 5.0, 0.0, 1.0, 0.0)
    assert draft.position == pytest.approx(5 - 5 * np.cos(4 * np.pi * draft.time_s))
    parts.hand(draft, 0.0, 0.0, 3.0, 0.0, 5.0, 2.0, 7.0, 0.4)
    assert draft.position == pytest.approx(2 * np.sin(7 * draft.time_s + 0.4))
    assert draft.velocity[1:-1] == pytest.approx(14 * np.cos(7 * draft.time_s + 0.4)[1:-1], abs=0.01)
    parts.hand(draft, 0.0, 0.8, 4 * np.pi, 0.3, 5.0, 0.0, 1.0, 0.0)
    assert np.ptp(draft.position) > 1 and draft.position[500:] == pytest.approx(draft.position[:500]), (
        "a swing of 0.5 s"
    )
    parts.constant(draft, -100.0, 0.0)
    parts.stick_slip(draft, 5.0, 0.0, 2.0)
    tooth = (0.1 * np.arange(1000) / 5) % 1 - 0.5
    inside = np.abs(np.abs(tooth) - 0.5) > 1e-6
    assert draft.added[inside] == pytest.approx(-2 * math.sqrt(12) * tooth[inside])


def test_a_number_in_place_of_a_rule_is_what_it_draws_about(draft):
    Part("strokes", {"peak_mm_s": 55.0})(draft)
    assert np.abs(draft.velocity).max() == pytest.approx(55, rel=0.01)
    Part("strokes", {"peak_mm_s": {"about": 66.0}})(draft)
    assert np.abs(draft.velocity).max() == pytest.approx(66, rel=0.01)


def test_errors_of_the_clock_and_of_the_velocity(draft):
    parts.smoothed(draft, 0.02)
    assert draft.known[19] == pytest.approx(100 * (1 - math.exp(-1))), "a time constant after a step from 0"
    parts.dropped(draft, 0.03, 0.25, 0.05)
    assert np.isnan(draft.added).mean() == pytest.approx(0.2, abs=2e-3) and np.isnan(draft.added[[1, 18, 222]]).all()
    parts.stamped(draft, 0.01)
    assert draft.time_s[[0, 9, 10, 25]] == pytest.approx([0, 0, 0.01, 0.02])


# ---- Disturbances


def without_noise(name, **options):
    return scene(name, 1.8, snr_dB=300, seed=4, seconds=2.0, **options)


@pytest.mark.slow
def test_a_surface_without_a_line_has_no_truth():
    for name, recipe in SCENES_BY_NAME.items():
        made = without_noise(name)
        assert np.isfinite(made.wavelength_mm).all() == recipe.lined, name
        assert np.isnan(made.signal).any() == ("dropped" in name), name
    assert not SCENES_BY_NAME["const, hum only"].lined and SCENES_BY_NAME["const, hum"].lined
    assert [SCENES_BY_NAME[name].clean for name in ("act2", "harsh", "const, rounded")] == [True, False, False]


def test_hum_keeps_its_frequency_and_its_size():
    made = without_noise("strokes, hum only")
    power = np.abs(np.fft.rfft(made.signal[:, 0])) ** 2
    assert np.argsort(power)[-2:].tolist() == [300, 100], "50 Hz, and weaker its third harmonic, of 2 s"
    assert made.signal.std() == pytest.approx(2 * math.sqrt(1 + 1 / 16), rel=0.01)


def test_the_path_as_it_is_told():
    def away(name):
        made = without_noise(name)
        told = np.cumsum(made.known_mm_s) / 1000
        return made, told - made.position_mm

    made, off = away("strokes, 10 ms late")
    assert made.known_mm_s[10:] == pytest.approx(made.velocity_mm_s[:-10]) and np.abs(off).max() > 0.5
    made, off = away("strokes, scale 3 % off")
    assert made.known_mm_s == pytest.approx(1.03 * made.velocity_mm_s)
    made, off = away("strokes, encoder counts")
    assert np.abs(off - off.mean()).max() < 0.06 and np.unique(made.known_mm_s).size < 12


def test_a_block_holds_the_stated_velocity_or_a_later_one():
    made = scene("strokes, scale 3 % off", 1.8, seed=4, seconds=0.5, gauge_positions_mm=(0.0, 1.0))
    assert np.array_equal(made.block(), np.column_stack([made.readings, made.known_mm_s]))
    late = made.block(delay_samples=7, gain=1.1)[:, 2]
    assert late[7:] == pytest.approx(1.1 * made.known_mm_s[:-7]) and (late[:7] == 1.1 * made.known_mm_s[0]).all()


@pytest.mark.parametrize(
    "second, period", [(0.9, [1.8]), (1.2, [3.6]), (1.195, [3.6]), (1.08, [5.4]), (4.5, [9.0]), (1.15, []), (1.125, [])]
)
def test_two_gratings_may_have_a_period_in_common(second, period):
    assert common_period(1.8, second) == pytest.approx(period)


def test_two_lines_are_both_right_and_a_step_has_two_truths():
    two, step = without_noise("const, two lines"), without_noise("step")
    turns = 2j * math.pi * two.position_mm
    first, second, between = (abs(np.mean(two.signal[:, 0] * np.exp(turns / x))) for x in (1.8, *two.others_mm, 1.4))
    assert two.others_mm == pytest.approx([0.62 * 1.8]) and first > 0.3 < second and between < 0.05
    assert step.wavelength_mm[0] == 1.8 and step.wavelength_mm[-1] == 0.7


@pytest.mark.slow
def test_estimators_tell_a_felt_grating_and_single_edges_apart():
    """The grating has its wavelength and unit power; edges are not taken for the ridges that feel them."""
    for name in ("const, felt by FEM", "const, edges felt by FEM"):
        made = scene(name, 1.2, snr_dB=40, seed=1, seconds=1.0)
        pipeline = Pipeline(None, gauges=made.readings.shape[1], columns=("velocity_mm_s",))
        answers = pipeline.process(np.column_stack([made.time_s, made.readings, made.known_mm_s]))
        ok = np.array([words.startswith("ok") for words in answers.wavelength_status])
        near = ok & (np.abs(np.asarray(answers.wavelength_mm) / 1.2 - 1) < 0.01 + 0.04 * ("edges" in name))
        if "edges" in name:
            assert np.isnan(made.wavelength_mm).all() and not near.any()
        else:
            assert made.signal.std() == pytest.approx(1.0, rel=1e-6) and near[-1]


def test_a_recipe_is_clean_without_disturbance_skin_or_another_surface():
    way, hum = Part("constant"), (Part("hum", {}),)
    assert Recipe(way, Part("grating", {})).clean and SCENES_BY_NAME["act2"].clean
    for other in ({"surface": Part("smooth", {})}, {"disturbances": hum}, {"skin": Part("sheared")}):
        assert not Recipe(way, **{"surface": Part("grating", {}), **other}).clean, other
    assert Recipe(way, disturbances=hum).hums and not Recipe(way).hums
    for name, lined in (("smooth", False), ("rough", False), ("felt_edges", False), ("two_lines", True)):
        assert Recipe(way, Part(name)).lined is lined


def test_a_step_is_halfway_where_no_time_is_said_and_to_the_other_side(draft):
    for asked, to in ((1.2, 4.0), (3.0, 0.7)):
        draft.asked_mm = asked
        parts.step(draft, 0.7, 4.0, 2.0)
        changed = np.flatnonzero(np.diff(draft.wavelength))
        assert changed.tolist() == [499] and draft.wavelength[[0, -1]].tolist() == [asked, to]
    parts.step(draft, 0.7, 4.0, 2.0, to_mm=1.5, at_s=0.2)
    assert np.flatnonzero(np.diff(draft.wavelength)).tolist() == [199] and draft.wavelength[-1] == 1.5


def test_a_lost_contact_fades_over_its_edge(draft):
    """A Gaussian of 20 ms: half at the edge, 84 % a deviation later."""
    parts.lost(draft, 0.0, 0.5, 0.2, 8.0, 0.02)
    rise = draft.texture[180:221, 0]
    assert (rise[19] + rise[20]) / 2 == pytest.approx(0.5, abs=0.01) and rise[40] == pytest.approx(0.84, abs=0.02)


def test_a_grating_felt_by_the_finger_is_the_middle_gauge_of_its_section(draft):
    draft.asked_mm, draft.offsets_mm = 2.0, np.array([0.0, 0.3])
    parts.felt_grating(draft, 0.1)
    texture = draft.texture
    assert (draft.wavelength == 2.0).all() and texture[:, 0].std() == pytest.approx(1) and texture.shape == (1000, 2)
    assert (texture[:, 0] == texture[:, 1]).all() and abs(texture[:, 0].mean()) < 1e-9
    power = np.abs(np.fft.rfft(texture[500:, 0] * np.hanning(500))) ** 2
    lines = np.add.outer(25 * np.arange(1, 10), (-1, 0, 1)).ravel()
    assert power[lines].sum() > 0.8 * power.sum(), "multiples of 50 Hz: 100 mm/s over 2 mm"


def test_short_teeth_go_on_to_the_end_of_a_path(draft):
    parts.stick_slip(draft, 0.35, 0.1, 1.0)
    late = draft.added[-100:]
    assert late.std() == pytest.approx(1, rel=0.15) and late.min() < -1.3 and late.max() > 1.3


def test_rows_are_judged_that_are_settled_and_fast():
    made = replace(without_noise("const"), velocity_mm_s=np.linspace(0, 4, 2000))
    assert np.flatnonzero(made.judged()).tolist() == list(range(1001, 2000))
    assert np.flatnonzero(made.judged(0.0, 0.8)).tolist() == list(range(1600, 2000))


def test_edges_reach_beyond_the_path_to_both_sides(draft):
    """Gauges of the finger stand before and behind the path: the skin is there as well, in steps at random places."""
    parts.felt_edges(draft, 0.1, 5.0, 0.02, 12.0)
    assert np.isnan(draft.wavelength).all() and draft.texture[:, 0].std() == pytest.approx(1)
    assert draft.texture[:50, 0].std() > 0.1 < draft.texture[-50:, 0].std()
