"""report.html: self-contained, escaped, and saying what the calibration's own numbers say."""

import html
import re
from dataclasses import replace

import numpy as np
import pytest

from papilla.calibration import SoftnessStatus
from papilla.calibration.fitting import page
from papilla.calibration.fitting.job import Calibrated, Recovery
from papilla.calibration.fitting.page import AnswerMap, force_cost, slopes, write_report
from papilla.core.errors import InputError
from papilla.view.page import number


class Page:
    """Its addresses, and its words one space apart; each tag that opens is closed."""

    def __init__(self, text: str):
        opened = []
        for closing, name in re.findall(r"<(/?)([a-z][a-z0-9]*)[^>]*>", re.sub(r"(?s)<svg.*?</svg>", "", text)):
            if closing:
                assert opened.pop() == name
            elif name not in ("meta", "img", "source", "br"):
                opened.append(name)
        assert not opened and "<script" not in text
        self.addresses = re.findall(r"""(?:src|srcset|href|action)\s*=\s*["']?([^"'\s>]*)""", text)
        words = re.sub(r"(?s)<style.*?</style>|</?su[bp][^>]*>|<(?=[a-z])[^>]+>", "", text)
        self.text = " ".join(html.unescape(re.sub(r"</[a-z0-9]+>", " ", words)).split())


@pytest.fixture(scope="module")
def swept(made_up, calibration) -> Calibrated:
    """A calibration from the made-up sweep, which has no reduced finger."""
    force, modulus = np.array([0.3, 0.5, 0.9]), np.array([0.1, 0.4, 0.6])
    recovered = modulus * np.array([1.004, 0.998, np.nan])
    return Calibrated(calibration, made_up, Recovery(force, modulus, recovered))


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    """Write a report and read it."""

    def write(done, **more) -> Page:
        path = tmp_path_factory.mktemp("report") / "report.html"
        write_report(path, done, **more)
        return Page(path.read_text(encoding="utf-8"))

    return write


def shown(value, digits) -> str:
    """A number as the page writes it, before its power of ten."""
    return str(number(value, digits)).replace("\u202f", "").split("·")[0]


def test_the_page_fetches_nothing_and_holds_every_coefficient_its_error_and_the_notes(read, swept):
    name, known = r"<script>alert(1)</script>$\bad{$ &amp; \frac", swept.calibration
    gauges = (replace(known.gauges[0], name=name), *known.gauges[1:])
    odd = replace(known, finger={"name": name, "sha256": "0"}, gauges=gauges)
    page = read(replace(swept, calibration=odd), seconds=2.5)
    assert (
        name in page.text
        and len(page.addresses) >= 4
        and all(source.startswith("data:image/") for source in page.addresses)
    )
    forward, inverse = swept.calibration.forward, swept.calibration.inverse
    for values, digits in (((*forward.coefficients, *inverse.coefficients), 5), (forward.stderr, 2)):
        for value in values:
            assert shown(value, digits) in page.text.replace(" ", "")
    for note in swept.calibration.notes:
        assert note.replace("f2", "f²").replace("E2", "E²").replace("S_d", "Sd") in page.text


def test_friction_that_is_not_known_costs_a_part_of_the_domain(calibration):
    """Here it moves ln S_d by 0.2."""
    surface, wider = calibration.surface, calibration.surface.surface
    friction = replace(wider, coefficients=0.2 + 0 * wider.coefficients)
    known = replace(surface.uncertainty, friction=friction)
    doubted = replace(calibration, surface=replace(surface, uncertainty=known))
    assert page.share_with_known_friction(calibration) is None
    assert page.share_with_known_friction(doubted) == AnswerMap.of(calibration).share > AnswerMap.of(doubted).share


def test_the_map_answers_with_the_truth_where_it_answers(calibration):
    answers = AnswerMap.of(calibration)
    assert answers.status.shape == (len(answers.force_N), len(answers.modulus_MPa))
    assert set(np.unique(answers.status)) <= {SoftnessStatus.OK, SoftnessStatus.NOT_IDENTIFIABLE}
    assert answers.identified.mean() > 0.5
    assert (answers.relative_sigma[answers.identified] <= 0.5).all()


def test_a_sweep_without_its_finger_is_refused(swept, tmp_path):
    with pytest.raises(InputError, match="needs the finger"):
        write_report(tmp_path / "report.html", replace(swept, reduced=object()))
    assert not list(tmp_path.iterdir())


def test_slopes_are_those_of_the_surface(calibration):
    surface = calibration.surface
    scattered = replace(surface.uncertainty, scatter=np.full_like(surface.uncertainty.scatter, 0.01))
    force, rows = slopes(replace(calibration, surface=replace(surface, uncertainty=scattered)))
    assert force == pytest.approx(0.4903, abs=1e-4)
    assert [modulus for modulus, *_ in rows] == [0.05, 0.089, 0.2, 0.51, 0.72, 2.0, 5.0]
    step = 1e-5
    for modulus, slope, scatter, cost in rows[:-1]:
        rise = np.log(calibration.predict(force, modulus * (1 + step)) / calibration.predict(force, modulus)) / step
        assert slope == pytest.approx(rise, rel=1e-3)
        assert scatter == pytest.approx(0.01) and cost == pytest.approx(0.01 / slope)


def test_the_cost_of_force_is_slope_over_slope(calibration):
    force, rows = force_cost(calibration)
    assert force == 0.5 and [modulus for modulus, _ in rows] == [0.089, 0.51, 0.72]
    for modulus, share in rows:
        along_force, along_modulus = calibration.surface.surface.slopes(force, modulus)
        assert share == pytest.approx(0.01 * along_force / along_modulus, rel=1e-2)
