"""What a simulated sensor samples, and what of softness and friction is in a message with which status."""

import math

import numpy as np
import pytest

from papilla.core.errors import FileFormatError, InputError
from papilla.telepresence import ContactArea, GratingTexture, HandMotion, QuantityTrust, Soft, TouchLog
from papilla.telepresence.messages import Header, decode, encode
from tests.support.spring_calibration import FORCE, calibration

HEADER = Header(1, 5, 1, 10, 0, 0, 0)
QUIET = [0.0] * 7


def area():
    """60 f^0.6 E^-0.2 mm2 over the calibration."""
    force, modulus = (grid.ravel() for grid in np.meshgrid(np.geomspace(*FORCE, 5), np.geomspace(0.02, 5, 5)))
    return ContactArea.of_presses(force, modulus, 60 * force**0.6 * modulus**-0.2)


def test_a_row_is_the_press_and_the_texture_one_gauge_after_the_other():
    made, texture = calibration(), GratingTexture(1.3)
    touch = TouchLog(texture, 2.0, Soft(made, 0.3, friction=0.4))
    *gauges, force, place, pull = touch.row(20.0, 50.0, 0.5, QUIET)
    textures = [texture.reading(20.0 - 6.0 * number, 50.0) for number in range(5)]
    assert gauges == pytest.approx(made.predict_readings(0.5, 0.3) + textures, rel=1e-5)
    assert (force, place) == (0.5, 20.0) and pull == pytest.approx(0.2)
    noisy = touch.row(20.0, -50.0, 0.5, [1.0] * 7)
    assert noisy[0] == pytest.approx(gauges[0] + 2.0) and noisy[-1] == pytest.approx(-0.2, abs=0.002)
    in_air = touch.row(20.0, 50.0, 0.0, QUIET)
    assert in_air[:5] == pytest.approx(textures) and in_air[-1] == 0


def test_every_gauge_and_both_forces_have_a_noise_of_their_own():
    touch = TouchLog(GratingTexture(1.3), 2.0, Soft(calibration(), 0.3))
    quiet = np.array(touch.row(20.0, 50.0, 0.5, QUIET))
    noises = np.array([touch.row(20.0, 50.0, 0.5, row) for row in np.eye(touch.numbers).tolist()]) - quiet
    expected = np.zeros((7, 8))
    expected[range(5), range(5)] = 2.0  # the gauges, in microstrain
    expected[5, 5] = expected[6, 7] = 1e-3  # force and tangential force in N; the place between them is exact
    assert noises == pytest.approx(expected, abs=1e-9)
    assert TouchLog(GratingTexture(1.3)).numbers == 1, "a gauge over a texture"


@pytest.mark.parametrize("force", [1.01, -0.1, math.nan])
def test_beyond_the_calibrated_forces_there_is_no_reading(force):
    row = TouchLog(GratingTexture(1.3), 0.0, Soft(calibration(), 0.3)).row(1.0, 2.0, force, QUIET)
    assert all(math.isnan(value) for value in row[:5])


def test_what_no_finger_was_calibrated_for_is_refused():
    for options in ({"modulus_MPa": 6.0}, {"modulus_MPa": 0.01}, {"modulus_MPa": 0.3, "friction": -1}):
        with pytest.raises(InputError):
            Soft(calibration(), **options)
    with pytest.raises(InputError):
        TouchLog(GratingTexture(1.0), noise_microstrain=-1)


def test_a_message_tells_each_quantity_with_sigma_and_status():
    touch = TouchLog(GratingTexture(1.3, 1e-6), 1.0, Soft(calibration(), 0.3, 0.4, area=area()))
    sensing, motion, rng = touch.sensing(), HandMotion(), np.random.default_rng(0)
    before = sensing.parameters(HEADER)
    assert before.modulus is None and before.mu_kinetic is None
    for now in np.arange(1, 1500) / 1000:
        place, force = float(motion.place_mm(now)), float(motion.force_N(now))
        speed = 1e3 * (float(motion.place_mm(now + 0.001)) - place)
        sensing.update((float(now), *touch.row(place, speed, force, rng.standard_normal(7).tolist())))
    told = decode(encode(sensing.parameters(HEADER)))
    assert abs(told.modulus.value - 0.3) < 3 * told.modulus.sigma
    assert told.area.value == pytest.approx(60 * told.force.value**0.6 * told.modulus.value**-0.2, rel=1e-6)
    assert told.area.sigma > 0.01 * told.area.value and told.area.status == told.modulus.status
    said = sensing.pipeline.sentences
    assert (told.modulus.status == QuantityTrust.OK) == said["modulus"].startswith("ok")
    assert told.mu_kinetic.value == pytest.approx(0.4, abs=4 * told.mu_kinetic.sigma) and told.mu_kinetic.sigma < 0.05
    # The force leaves the table: no answer is an answer.
    sensing.update((1.6, *touch.row(30.0, 0.0, 0.0, QUIET)))
    told = sensing.parameters(HEADER)
    assert told.area.value is None and told.area.status == QuantityTrust.UNKNOWN


def test_not_identifiable_is_doubted_and_one_stroke_doubts_its_friction():
    touch = TouchLog(GratingTexture(1.3, 1e-6), 1.0, Soft(calibration(), 4.0, 0.4))
    sensing = touch.sensing()
    for number in range(60):
        sensing.update((1e-3 * number, *touch.row(0.1 * number, 100.0, 0.5, QUIET)))
    told = sensing.parameters(HEADER)
    assert not sensing.pipeline.sentences["modulus"].startswith("ok") and told.modulus.status != QuantityTrust.OK
    assert told.mu_kinetic is not None and told.mu_kinetic.status != QuantityTrust.OK


FORCES, MODULI = np.geomspace(0.05, 1, 7), np.geomspace(0.05, 1, 5)


def law(force, modulus):
    return 60 * force**0.6 * modulus**-0.2


def presses():
    force, modulus = (grid.ravel() for grid in np.meshgrid(FORCES, MODULI))
    return force, modulus, law(force, modulus)


@pytest.mark.parametrize("force, modulus", [(0.05, 0.05), (0.33, 0.21), (1.0, 1.0), (0.051, 0.99)])
def test_a_power_law_is_exact_and_sigma_is_that_of_the_modulus_and_the_mesh(force, modulus):
    forces, moduli, areas = presses()
    for scale in (1.0, 1e-3):
        area, sigma = ContactArea.of_presses(forces, moduli, scale * areas)(force, modulus, 0.1 * modulus)
        assert area == pytest.approx(scale * law(force, modulus))
        assert sigma / area == pytest.approx(math.hypot(0.01, 0.2 * 0.1))


def test_outside_the_table_and_of_what_is_unknown_there_is_no_area():
    table = ContactArea.of_presses(*presses())
    for force, modulus in ((0.04, 0.1), (1.1, 0.1), (0.5, 0.01), (0.5, 2), (math.nan, 0.1), (0.1, math.nan)):
        assert all(math.isnan(value) for value in table(force, modulus))
    force, modulus, area = presses()
    area[7] = math.nan
    assert math.isnan(ContactArea.of_presses(force, modulus, area)(FORCES[0], MODULI[1])[0])


def test_a_sweep_file_is_read_and_another_refused(tmp_path):
    rows = np.column_stack(presses())
    path = tmp_path / "sweep.csv"
    np.savetxt(path, rows, delimiter=",", header="force_N,modulus_MPa,contact_area_mm2", comments="")
    assert ContactArea.load(path)(0.2, 0.2)[0] == pytest.approx(law(0.2, 0.2))
    np.savetxt(path, rows, delimiter=",", header="force_N,modulus_MPa,g1", comments="")
    with pytest.raises(FileFormatError, match="sweep.csv: no column contact_area_mm2"):
        ContactArea.load(path)
    np.savetxt(path, rows[:1], delimiter=",", header="force_N,modulus_MPa,contact_area_mm2", comments="")
    with pytest.raises(FileFormatError, match=r"sweep.csv: force_N must be two or more"):
        ContactArea.load(path)
    with pytest.raises(InputError, match="moduli x forces"):
        ContactArea(FORCES, MODULI, np.ones((2, 2)))
