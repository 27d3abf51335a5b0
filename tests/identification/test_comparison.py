"""Calibrations and fingers side by side: the verdict follows from the numbers, and the page shows them."""

import csv
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from papilla.calibration import fit
from papilla.calibration.fitting.sweep import SHOWN_PRESS
from papilla.core.errors import InputError
from papilla.identification.comparison import (
    COMPARED_NOISE,
    Candidate,
    candidate,
    compare,
    write_comparison,
    write_comparison_table,
)


@pytest.fixture(scope="module")
def both(made_up):
    """The made-up finger, and one whose gauges read a hundredth of it."""
    weak = replace(made_up, reading=made_up.reading / 100, sd_microstrain=made_up.sd_microstrain / 100)
    return [Candidate("strong", fit(made_up)), Candidate("weak", fit(weak))]


@pytest.fixture(scope="module")
def found(both):
    return compare(both)


def test_what_reads_more_over_the_same_noise_tells_the_modulus_better(found):
    strong, weak = found.rows
    assert strong.sd_microstrain == pytest.approx(100 * weak.sd_microstrain, rel=1e-6)
    assert strong.slope == pytest.approx(weak.slope, rel=1e-6)
    assert strong.sigma < weak.sigma and strong.identified > weak.identified
    text = "\n".join(found.verdicts)
    assert "Standard deviation of E, median over the domain: strong is better (strong" in text
    assert re.search("d ln S_d / d ln E: (strong and weak|weak and strong) are alike", text)
    assert "strong determines the modulus better than weak in 100 % of the domain" in text


def test_the_uncertainty_is_the_calibration_s_own(found, both):
    calibration, k, m = both[0].calibration, 5, 20
    force, modulus = float(found.force_N[k]), float(found.modulus_MPa[m])
    one = calibration.invert(
        calibration.predict(force, modulus), force, sd_sigma=COMPARED_NOISE / np.sqrt(5), force_sigma=0.01 * force
    )
    assert found.rows[0].relative_sigma[k, m] == pytest.approx(one.sigma_MPa / one.modulus_MPa, rel=1e-9)


def test_points_lie_evenly_within_the_domain_and_rise(found, both):
    for points, key in ((found.force_N, "force_N"), (found.modulus_MPa, "modulus_MPa")):
        low, high = both[0].calibration.domain[key]
        steps = np.diff(np.log(points))
        assert steps == pytest.approx(np.log(high / low) / len(points))
        # Half a step from either end, so that no point lies on the border
        assert points[0] / low == pytest.approx(np.exp(steps[0] / 2)) == high / points[-1]


def test_only_the_shared_domain_is_judged(both, made_up):
    hard = made_up.modulus_MPa > 0.6
    columns = (
        "force_N",
        "modulus_MPa",
        "reading",
        "sd_microstrain",
        "indentation_mm",
        "contact_area_mm2",
        "specimen_error",
    )
    part = {name: getattr(made_up, name)[hard] for name in (*columns, "peak_pressure_MPa", "resolved")}
    status = tuple(one for one, kept in zip(made_up.status, hard, strict=True) if kept)
    other = Candidate("hard", fit(replace(made_up, status=status, **part)))
    judged = compare([both[0], other])
    assert judged.modulus_MPa.min() > 0.6
    force, modulus = judged.scene
    assert (
        judged.force_N[0] <= force <= judged.force_N[-1] and judged.modulus_MPa[0] <= modulus <= judged.modulus_MPa[-1]
    )
    assert all(np.isfinite(row.sd_microstrain) for row in judged.rows), "the press that is compared lies in the domain"
    assert compare(both).scene == SHOWN_PRESS


def test_fewer_than_two_and_the_same_twice_are_refused(both):
    with pytest.raises(InputError, match="at least two"):
        compare(both[:1])
    with pytest.raises(InputError, match="strong is given twice"):
        compare([both[0], both[0]])


def test_page_and_table_hold_the_rows(found, both, tmp_path):
    write_comparison(tmp_path / "c.html", found, both)
    page = (tmp_path / "c.html").read_text(encoding="utf-8")
    assert all(sentence.replace("'", "&#39;") in page for sentence in found.verdicts)
    assert page.count("data:image/svg+xml") == 4 and "Receptive" not in page
    write_comparison_table(tmp_path / "c.csv", found)
    rows = list(csv.DictReader((tmp_path / "c.csv").read_text(encoding="utf-8").splitlines()))
    assert [row["name"] for row in rows] == ["strong", "weak"] and rows[0]["press_ms"] == ""
    assert float(rows[1]["sigma"]) == found.rows[1].sigma
    json.dumps([row.to_json() for row in found.rows])


def test_a_file_of_a_calibration_is_loaded(both, tmp_path):
    both[0].calibration.save(tmp_path / "strong.json")
    loaded = candidate(tmp_path / "strong.json")
    assert loaded.finger is None and loaded.name.endswith("strong.json")
    assert loaded.calibration.predict(0.5, 0.5) == both[0].calibration.predict(0.5, 0.5)
