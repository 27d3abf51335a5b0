"""report.html: self-contained, escaped, and saying what the calibration's own numbers say."""

import random
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from odd_names import odd_names

from papilla.calibration import SoftnessStatus, fit
from papilla.calibration.fitting import page
from papilla.calibration.fitting.job import Calibrated, Recovery
from papilla.calibration.fitting.page import AnswerMap, force_cost, slopes, write_report
from papilla.core.errors import InputError
from papilla.model.finger import Finger
from papilla.view.page import number

VOID = {"meta", "img", "source", "br"}


class Reader(HTMLParser):
    """Checks nesting; collects the text, the image sources and every address."""

    def __init__(self, text: str):
        super().__init__()
        self.open: list[str] = []
        self.words: list[str] = []
        self.images: list[str] = []
        self.others: list[str] = []
        self.feed(text)
        self.close()
        assert not self.open, f"not closed: {self.open}"

    def handle_starttag(self, name, attributes):
        if name not in VOID:
            self.open.append(name)
        for key, value in attributes:
            if key in ("src", "srcset"):
                self.images.append(value)
            elif key in ("href", "action") or name == "script":
                self.others.append(f"{name} {key}={value}")

    def handle_endtag(self, name):
        assert self.open.pop() == name
        if name not in ("sub", "sup"):
            self.words.append(" ")

    def handle_data(self, data):
        if self.open[-1:] != ["style"]:
            self.words.append(data)

    @property
    def text(self) -> str:
        """The page's words, one space apart."""
        return " ".join("".join(self.words).split())


@pytest.fixture(scope="module")
def swept(made_up, calibration) -> Calibrated:
    """A calibration from the made-up sweep, which has no reduced finger."""
    force, modulus = np.array([0.3, 0.5, 0.9]), np.array([0.1, 0.4, 0.6])
    recovered = modulus * np.array([1.004, 0.998, np.nan])
    return Calibrated(calibration, made_up, Recovery(force, modulus, recovered))


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    """Write a report and read it."""

    def write(done, **more) -> Reader:
        path = tmp_path_factory.mktemp("report") / "report.html"
        write_report(path, done, **more)
        return Reader(path.read_text(encoding="utf-8"))

    return write


@pytest.fixture(scope="module")
def sweep_page(read, swept) -> Reader:
    return read(swept, seconds=2.5)


def test_the_page_is_well_formed_and_fetches_nothing(sweep_page):
    assert not sweep_page.others
    assert len(sweep_page.images) >= 4
    assert all(source.startswith("data:image/") for source in sweep_page.images)


def test_every_coefficient_is_on_the_page_with_its_error(sweep_page, swept):
    forward, inverse = swept.calibration.forward, swept.calibration.inverse
    squeezed = "".join(sweep_page.text.split())
    for value in (*forward.coefficients, *inverse.coefficients):
        assert str(number(value, 5)).replace("\u202f", "").split("·")[0] in squeezed
    for value in forward.stderr:
        assert str(number(value, 2)).replace("\u202f", "").split("·")[0] in squeezed


def test_the_notes_of_the_fit_are_among_the_doubts(sweep_page, swept):
    for note in swept.calibration.notes:
        assert note.replace("f2", "f²").replace("E2", "E²").replace("S_d", "Sd") in sweep_page.text


@pytest.fixture
def doubted(swept):
    """The calibration, if unknown friction moved ln S_d by 0.2."""
    known = swept.calibration
    surface, wider = known.surface, known.surface.surface
    friction = replace(wider, coefficients=0.2 + 0 * wider.coefficients)
    return replace(known, surface=replace(surface, uncertainty=replace(surface.uncertainty, friction=friction)))


def test_friction_that_is_not_known_costs_a_part_of_the_domain(swept, doubted):
    known = swept.calibration
    assert page.share_with_known_friction(known) is None
    assert page.share_with_known_friction(doubted) == AnswerMap.of(known).share > AnswerMap.of(doubted).share


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_an_odd_name_is_on_the_page_letter_by_letter_and_odd_gauges_are_drawn(read, swept, sweep_page, seed):
    finger, *names = odd_names(random.Random(seed), 1 + len(swept.calibration.gauges))
    gauges = tuple(replace(gauge, name=name) for gauge, name in zip(swept.calibration.gauges, names, strict=True))
    named = replace(
        swept, calibration=replace(swept.calibration, finger={"name": finger, "sha256": "0"}, gauges=gauges)
    )
    shown = read(named)
    assert " ".join(finger.split()) in shown.text and shown.others == sweep_page.others


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


@pytest.mark.slow
def test_the_report_of_the_default_finger_shows_its_field(read, tmp_path, monkeypatch):
    from papilla import fem
    from papilla.calibration import sweep
    from papilla.calibration.fitting.job import recover

    finger = Finger.default()
    reduced = fem.prepare(finger)
    presses = sweep(reduced, np.geomspace(0.02, 5, 14), np.geomspace(0.05, 1, 12))
    calibration = fit(presses)
    lines: list[str] = []
    done = Calibrated(calibration, presses, recover(calibration, reduced, "stick"), reduced)
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "cache"))  # Other tests draw this field, too
    found = read(done, finger=finger, progress=lines.append)
    assert any(source.startswith("data:image/png") for source in found.images)
    assert "No independent mesh" in found.text
    assert "The readings are strains, not a foil's output" in found.text
    assert "recovering the strain field" in lines
    again: list[str] = []
    assert read(done, finger=finger, progress=again.append).text == found.text
    assert not again, "the second report computed its field anew"


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
