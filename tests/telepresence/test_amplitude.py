"""How strongly a component is displayed: the printed gain, and g_A with its file."""

import json
import math

import numpy as np
import pytest

from papilla.core.errors import FileAccessError, FileFormatError, InputError
from papilla.telepresence import FromWavelength, Measured, PowerCurve, read_curve


def test_the_measured_amplitude_has_the_printed_gain():
    assert Measured()(1.2, 100.0) == pytest.approx(23.8)


def test_the_shipped_curve_has_a_local_maximum_inside_and_is_nowhere_negative():
    curve = read_curve()
    low, high = curve.fit.wavelength_mm
    grid = np.linspace(low, high, 100)
    power = np.array([curve(wavelength) for wavelength in grid])
    assert (low, high) == (0.8, 2.0) and (power > 0).all()
    assert 1.0 < grid[np.argmax(power)] < 1.5
    assert curve.fit.r_squared > 0.7 and 0.3 < curve.as_printed.r_squared < 1


def test_a_known_curve_comes_back_and_amplitude_goes_with_its_root():
    wavelength = np.linspace(0.8, 2.0, 9)
    curve = PowerCurve(tuple(wavelength), tuple(7 * np.exp(-((wavelength - 1.4) ** 2))))
    assert curve.fit.r_squared == pytest.approx(1) and curve(1.2) == pytest.approx(7 * math.exp(-0.04))
    root, printed = FromWavelength(curve), FromWavelength(curve, as_printed=True)
    assert root(1.4) == pytest.approx(27.5) == printed(1.4)
    assert root(0.9) / 27.5 == pytest.approx(math.sqrt(printed(0.9) / 27.5))
    assert math.isnan(root(0.7)) and math.isnan(root(2.1)) and math.isnan(root(math.nan))
    with pytest.raises(InputError):
        curve(0.5)


def test_the_printed_quartic_is_one_of_the_power_over_the_wavelength():
    wavelength = np.linspace(0.8, 2.0, 9)
    quartic = np.polynomial.Polynomial([3.0, -2.0, 1.5, 0.5, 0.25])
    printed = PowerCurve(tuple(wavelength), tuple(quartic(wavelength))).as_printed
    assert printed.r_squared == pytest.approx(1) and printed.wavelength_mm == pytest.approx((0.8, 2.0))
    assert printed(1.3) == pytest.approx(quartic(1.3))


@pytest.mark.parametrize(
    "content",
    [
        "",
        "[]",
        "{}",
        '{"schema": "other"}',
        '{"schema": "papilla.amplitude/1", "wavelength_mm": [1], "power": [1]}',
        "\ud800",
    ],
)
def test_a_file_that_is_no_curve_is_one_line(tmp_path, content):
    path = tmp_path / "curve.json"
    path.write_bytes(content.encode("utf-8", "surrogatepass"))
    with pytest.raises(FileFormatError, match="curve.json(: not an amplitude curve| is not a )") as error:
        read_curve(path)
    assert "\n" not in str(error.value)


def test_a_file_of_points_is_fitted_and_a_missing_one_named(tmp_path):
    points = {"schema": "papilla.amplitude/1", "wavelength_mm": [1, 2, 3, 4, 5], "power": [1, 2, 4, 2, 1]}
    (tmp_path / "curve.json").write_text(json.dumps(points))
    assert read_curve(tmp_path / "curve.json")(3.0) == pytest.approx(4)
    (tmp_path / "mine.csv").write_text("wavelength_mm,power,note\n1,1,a\n2,2,b\n3,4,c\n4,2,d\n5,1,e\n")
    found = read_curve(tmp_path / "mine.csv")
    assert found(3.0) == pytest.approx(4) and found.source == "mine.csv"
    (tmp_path / "mine.csv").write_text("wavelength_mm\n1\n")
    with pytest.raises(FileFormatError, match="mine.csv: not an amplitude curve: no 'power'"):
        read_curve(tmp_path / "mine.csv")
    with pytest.raises(FileAccessError, match="none.json"):
        read_curve(tmp_path / "none.json")
