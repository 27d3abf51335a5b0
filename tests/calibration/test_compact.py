"""Five coefficients with a closed-form inverse: fitted, inverted, saved, and compiled from C."""

import dataclasses
import math
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from spring_calibration import FORCE, MODULUS, TRUE, calibration

from papilla.calibration import Calibration
from papilla.calibration.fitting.export_c import c_header
from papilla.calibration.fitting.fit import fit_compact, with_compact
from papilla.calibration.readouts import Compact
from papilla.core.errors import InputError


@pytest.fixture(scope="module")
def fitted() -> Calibration:
    return with_compact(calibration())


def test_a_surface_of_the_form_gives_its_coefficients_back(fitted):
    form = fitted.compact
    # The spline through samples of it is the form to a thousandth
    assert form.coefficients == pytest.approx(TRUE, abs=0.02)
    assert form.rms < 0.01 and form.sd_rms < 2e-3 and form.doubt == pytest.approx(0.01, rel=0.05)
    # Its errors are those of moduli that it recovers from the surface
    force, modulus = np.geomspace(*form.force_N, 30), np.geomspace(*form.modulus_MPa, 30)
    wide = dataclasses.replace(form, modulus_MPa=(0.0, math.inf))
    error = [wide.invert(float(fitted.predict(f, E)), f)[0] / E - 1 for f in force for E in modulus]
    assert form.max == pytest.approx(np.abs(error).max(), rel=0.1)
    assert form.rms == pytest.approx(np.sqrt(np.mean(np.square(error))), rel=0.2)


@pytest.mark.parametrize("modulus", [0.06, 0.2, 0.7])
@pytest.mark.parametrize("force", [0.1, 0.4, 0.9])
def test_the_inverse_is_exact_and_its_sigma_is_that_of_finite_differences(fitted, force, modulus):
    form = dataclasses.replace(fitted.compact, rms=0.0, doubt=0.0)
    sd = float(form.predict(force, modulus))
    assert form.invert(sd, force)[0] == pytest.approx(modulus, rel=1e-12)
    step = 1e-6
    by_sd = (form.invert(sd * (1 + step), force)[0] - form.invert(sd * (1 - step), force)[0]) / (2 * step * sd)
    by_force = (form.invert(sd, force * (1 + step))[0] - form.invert(sd, force * (1 - step))[0]) / (2 * step * force)
    assert form.invert(sd, force, 5.0, 0.0)[1] == pytest.approx(5.0 * abs(by_sd), rel=1e-5)
    assert form.invert(sd, force, 0.0, 1e-3)[1] == pytest.approx(1e-3 * abs(by_force), rel=1e-5)


def test_outside_what_was_fitted_there_is_no_answer(fitted):
    form = fitted.compact
    inside = float(form.predict(0.5, 0.3))
    outside = [(inside, 0.05), (inside, 2.0), (0.0, 0.5), (math.nan, 0.5), (inside, math.nan), (math.inf, 0.5)]
    outside += [(float(form.predict(0.5, 0.01)), 0.5), (float(form.predict(0.5, 3.0)), 0.5), (1e9, 0.5)]
    assert all(math.isnan(value) for sd, force in outside for value in form.invert(sd, force))


def test_it_is_in_the_file_and_comes_back(fitted, tmp_path):
    fitted.save(tmp_path / "c.json")
    back = Calibration.load(tmp_path / "c.json")
    assert back.file_note == "" and np.array_equal(back.compact.coefficients, fitted.compact.coefficients)
    assert dataclasses.replace(back.compact, coefficients=TRUE) != back.compact
    calibration().save(tmp_path / "without.json")
    assert Calibration.load(tmp_path / "without.json").compact is None


def test_what_does_not_fit_is_refused_and_left_out():
    small = calibration(modulus=(1.0, 5.0))
    for unfit in (small, calibration(falling=True)):
        with pytest.raises(InputError):
            fit_compact(unfit)
    assert with_compact(small).compact is None
    with pytest.raises(InputError, match="five finite coefficients"):
        Compact(np.array([1.0, 2.0]), FORCE, MODULUS, 0.0, 0.0, 0.0)


def compiled(folder: Path, language: str, source: Path, header: str) -> str:
    """A program of a source that includes the header, compiled with all warnings as errors."""
    names = ("cc", "gcc", "clang") if language == "c99" else ("c++", "g++", "clang++")
    compiler = next(filter(None, map(shutil.which, names)), None)
    if compiler is None:
        pytest.skip(f"no compiler of {language} on this machine")
    (folder / "papilla.h").write_text(header)
    strict = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-Wdouble-promotion", f"-I{folder}"]
    subprocess.run([compiler, f"-std={language}", *strict, str(source), "-o", folder / "main", "-lm"], check=True)
    return str(folder / "main")


MAIN = """
#include <stdio.h>
#include "papilla.h"
int main(void)
{
    papilla_real g[5] = {-2, 0.5, 7, 1, -1};
    double sd, force, sd_sigma, force_sigma;
    printf("%.17g 0 0 0 0\\n", (double)papilla_sd(g, 5));
    while (scanf("%lf %lf %lf %lf", &sd, &force, &sd_sigma, &force_sigma) == 4) {
        papilla_answer a = papilla_softness((papilla_real)sd, (papilla_real)force, (papilla_real)sd_sigma,
                                            (papilla_real)force_sigma);
        papilla_real sigma;
        papilla_modulus_MPa((papilla_real)sd, (papilla_real)force, (papilla_real)sd_sigma, (papilla_real)force_sigma,
                            &sigma);
        if (a.status == PAPILLA_OK && sigma != a.sigma_MPa) return 1;
        printf("%d %.17g %.17g %.17g %.17g\\n", (int)a.status, (double)a.modulus_MPa, (double)a.sigma_MPa,
               (double)a.lower_MPa, (double)a.upper_MPa);
    }
    return 0;
}
"""


@pytest.mark.parametrize("language, real, tolerance", [("c99", "double", 1e-9), ("c99", "float", 2e-4)])
def test_the_exported_header_answers_as_the_library_does(fitted, tmp_path, language, real, tolerance):
    source = tmp_path / ("main.c" if language == "c99" else "main.cpp")
    source.write_text(MAIN)
    program = compiled(tmp_path, language, source, c_header(fitted, real))
    rng = np.random.default_rng(1)
    rows = [(float(fitted.predict(f, e)), f, s, t) for f, e, s, t in zip(
        rng.uniform(0.05, 1.0, 300), rng.uniform(0.02, 1.0, 300), rng.uniform(0, 50, 300), rng.uniform(0, 0.01, 300),
        strict=True,
    )]  # fmt: skip
    rows += [(0.0, 0.5, 0, 0), (-1.0, 0.5, 0, 0), (1e9, 0.5, 0, 0), (1e9, 5.0, 0, 0), (math.nan, 0.5, 0, 0)]
    asked = "\n".join(" ".join(f"{value:.17g}" for value in row) for row in rows)
    told = subprocess.run([program], input=asked, capture_output=True, text=True, check=True).stdout
    (sd, *_), *answers = [tuple(map(float, line.split())) for line in told.splitlines()]
    assert sd == pytest.approx(np.std([-2.0, 0.5, 7.0, 1.0, -1.0]), rel=1e-15 if real == "double" else 1e-6)
    expected = [fitted.compact.answer(*row) for row in rows]
    assert {one.status.name for one in expected} == {"OK", "FORCE_OUTSIDE", "NO_READING", "SOFTER", "HARDER"}
    np.testing.assert_allclose(answers, expected, rtol=tolerance)


def test_the_interval_is_log_normal_and_holds_the_modulus(fitted):
    sd = float(fitted.compact.predict(0.4, 0.2))
    found = fitted.compact.answer(sd, 0.4, 5.0, 0.004)
    relative = found.sigma_MPa / found.modulus_MPa
    assert found.lower_MPa == pytest.approx(found.modulus_MPa * math.exp(-1.96 * relative), rel=1e-4)
    assert found.lower_MPa < 0.2 < found.upper_MPa


def test_the_example_in_cpp_compiles_and_answers_as_the_library_does(fitted, tmp_path):
    example = Path(__file__).parents[2] / "examples" / "softness.cpp"
    program = compiled(tmp_path, "c++11", example, c_header(fitted))
    sd = float(fitted.compact.predict(0.4, 0.2))
    lines = [" ".join(f"{sd * side:.9g}" for side in (-1, 1, -1, 1)) + f" {force}" for force in (0.4, 9.0)]
    done = subprocess.run([program], input="\n".join(lines), capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.splitlines()[1].endswith("force outside of the calibration")
    expected = fitted.compact.answer(sd, 0.4, 5.0 / 2, 2e-3)
    told = [float(word) for word in re.findall(r"[0-9.]+(?= MPa| to| \()", done.stdout.splitlines()[0])]
    assert told == pytest.approx([expected.modulus_MPa, expected.lower_MPa, expected.upper_MPa], rel=1e-4)
    assert subprocess.run([program], input="1\n", capture_output=True, text=True).returncode == 2


@pytest.mark.parametrize("real, ending", [("double", ""), ("float", "f")])
def test_whole_and_tiny_coefficients_are_numbers_of_c(fitted, real, ending):
    values = np.array([3.0, 0.5, 1e-5, -2.0, 1e-6])
    text = c_header(dataclasses.replace(fitted, compact=dataclasses.replace(fitted.compact, coefficients=values)), real)
    digits = ".17g" if real == "double" else ".9g"
    tiny = [f"{value:{digits}}{ending}" for value in (1e-5, 1e-6)]
    assert f"3.0{ending}, 0.5{ending}, {tiny[0]}, -2.0{ending}, {tiny[1]}" in text
