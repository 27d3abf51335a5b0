"""report.html: self-contained, escaped, and saying what the calibration's own numbers say."""

import math
import random
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest
from odd_names import odd_names

from papilla.calibration import SoftnessStatus, fit
from papilla.calibration.fitting import page
from papilla.calibration.fitting.checking import Truth
from papilla.calibration.fitting.job import Calibrated, Recovery
from papilla.calibration.fitting.page import AnswerMap, force_cost, provenance, slopes, symbols, write_report
from papilla.core.errors import FileAccessError, InputError
from papilla.fem import prepare
from papilla.model.finger import Finger
from papilla.model.specimen import Block
from papilla.view.page import number, percent, plain

DIAGRAMS = ("sd_against_force", "sd_against_modulus", "gauge_readings", "uncertainty_map", "recovery_map")
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


@pytest.fixture
def undrawn(monkeypatch):
    """Leave the diagrams out: drawing them takes most of the time of a page, and few tests look at them."""
    monkeypatch.setattr(page, "_plots", lambda *_: dict.fromkeys(DIAGRAMS, ""))


def test_the_largest_reading_of_a_sweep_is_a_strain(made_up):
    reading = np.array(made_up.reading)
    reading[3, 1], reading[5, 0] = -0.25e6, np.nan
    assert np.nanmax(np.abs(made_up.reading)) < 0.25e6
    assert page.largest_reading(replace(made_up, reading=reading)) == pytest.approx(0.25)


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


def test_the_headline_says_the_errors_and_what_was_left_unanswered(sweep_page):
    assert "0.40 % largest error of recovered E, same mesh, no noise; 2 of 3 answered" in sweep_page.text
    assert "0.32 % rms error" in sweep_page.text
    assert "2.5 s" in sweep_page.text
    assert "1 were left unanswered" in sweep_page.text


def test_the_notes_of_the_fit_are_among_the_doubts(sweep_page, swept):
    for note in swept.calibration.notes:
        assert note.replace("f2", "f²").replace("E2", "E²").replace("S_d", "Sd") in sweep_page.text


def test_the_cost_of_a_force_error_is_that_of_one_per_cent(sweep_page, swept):
    calibration = swept.calibration
    sigma = calibration.invert(calibration.predict(0.5, 0.51), 0.5, force_sigma=0.005).sigma_MPa
    assert "At 0.50 N an error of 1 % in force makes E uncertain by" in sweep_page.text
    assert f"{number(100 * sigma / 0.51, 2)} % at 0.51 MPa" in sweep_page.text


@pytest.mark.usefixtures("undrawn")
def test_no_error_without_the_share_of_answers(read, swept):
    """Where no press is answered there is no error, not one of 0 %."""
    none = Recovery(swept.recovery.force_N, swept.recovery.modulus_MPa, np.full(len(swept.recovery.error), np.nan))
    text = read(replace(swept, recovery=none)).text
    assert f"– % largest error of recovered E, same mesh, no noise; 0 of {len(none.error)} answered" in text
    assert none.answered == 0 and np.isnan(none.max_error) and np.isnan(none.rms_error)


def test_the_surface_comes_before_the_quadratic_and_both_are_explained(sweep_page):
    text = sweep_page.text
    assert text.index("Sd is the standard deviation") < text.index("What the gauges do")
    assert text.index("How well the modulus comes back from the surface") < text.index("The quadratic of the papers")
    assert "Regression (9) of the 2006 paper" in text and "(10) is its inverse" in text


@pytest.fixture
def doubted(swept):
    """The calibration, if unknown friction moved ln S_d by 0.2."""
    known = swept.calibration
    surface, wider = known.surface, known.surface.surface
    friction = replace(wider, coefficients=0.2 + 0 * wider.coefficients)
    return replace(known, surface=replace(surface, uncertainty=replace(surface.uncertainty, friction=friction)))


@pytest.mark.usefixtures("undrawn")
def test_what_is_not_identifiable_is_the_first_card_with_what_would_help(read, swept, doubted, sweep_page):
    text, share = read(replace(swept, calibration=doubted)).text, AnswerMap.of(doubted).share
    card = f"{percent(1 - share, 2)} of the domain (in ln force and ln modulus) is not identifiable"
    first = text.index(card.replace("\u00a0", " "))
    assert 0 < share < 1 and first < text.index("largest error of recovered E")
    known = percent(1 - AnswerMap.of(swept.calibration).share, 2).replace("\u00a0", " ")
    assert f"the friction stated ({known} would remain; --friction ), more force, a harder finger" in text
    assert "of the domain (in ln" not in sweep_page.text, "all of it is identifiable there"


def test_friction_that_is_not_known_costs_a_part_of_the_domain(swept, doubted):
    known = swept.calibration
    assert page.share_with_known_friction(known) is None
    assert page.share_with_known_friction(doubted) == AnswerMap.of(known).share > AnswerMap.of(doubted).share


def test_a_negative_branch_is_named(sweep_page, swept):
    assert swept.calibration.inverse.branch < 0
    assert "The E² coefficient is negative" in sweep_page.text
    assert number(swept.calibration.inverse.modulus_MPa[1]) in sweep_page.text


def test_the_printed_inverse_is_shown_to_be_off(sweep_page):
    """FACTS: up to +0.046 MPa from two digits."""
    assert "by up to +0.046 MPa" in sweep_page.text


@pytest.mark.usefixtures("undrawn")
def test_a_name_from_a_file_cannot_break_the_page(read, swept):
    nasty = '<script>alert("1")</script>&'
    named = replace(swept, calibration=replace(swept.calibration, finger={"name": nasty, "sha256": "0"}))
    assert nasty in read(named).text


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


def test_a_domain_elsewhere_leaves_the_comparison_out(read, truth, monkeypatch):
    labels, draw = [], page.view.plots.gauge_readings
    monkeypatch.setattr(page.view.plots, "gauge_readings", lambda *given: labels.append(given[-1]) or draw(*given))
    table = truth.sweep(np.geomspace(0.2, 0.5, 12), np.geomspace(0.3, 0.6, 12))
    within = Recovery(*(np.array([one]) for one in (0.4, 0.3, 0.3)))
    found = read(Calibrated(fit(table), table, within))
    assert "brings the calibration as close to (9)" not in found.text
    assert "calibrated over 0.3 to 0.6 N and 0.2 to 0.5 MPa" in found.text
    assert labels == ["0.316 MPa"], "the readings are shown in the geometric middle of the moduli"


def test_the_map_answers_with_the_truth_where_it_answers(calibration):
    answers = AnswerMap.of(calibration)
    assert answers.status.shape == (len(answers.force_N), len(answers.modulus_MPa))
    assert set(np.unique(answers.status)) <= {SoftnessStatus.OK, SoftnessStatus.NOT_IDENTIFIABLE}
    assert answers.identified.mean() > 0.5
    assert (answers.relative_sigma[answers.identified] <= 0.5).all()


def test_the_hardest_modulus_that_can_be_told(calibration):
    answers = AnswerMap.of(calibration)
    force, hardest, sigma = answers.hardest()
    row = np.flatnonzero(answers.force_N == force)[0]
    assert 0.05 < force < 1 and hardest == answers.modulus_MPa[answers.identified[row]].max()
    assert sigma == answers.relative_sigma[row, np.flatnonzero(answers.modulus_MPa == hardest)[0]]
    assert answers.share == answers.identified.mean()
    assert (answers.force_N[[0, -1]] == calibration.domain["force_N"]).all()
    nothing = replace(answers, status=np.full_like(answers.status, SoftnessStatus.NOT_IDENTIFIABLE))
    assert nothing.hardest()[1] is None and nothing.share == 0


def test_the_hardest_is_the_last_that_is_told_at_the_middle_force():
    status = np.full((3, 4), SoftnessStatus.OK)
    status[1] = [0, 0, 0, SoftnessStatus.HARDER]
    answers = AnswerMap(np.array([0.1, 0.2, 0.4]), np.arange(1.0, 5.0), np.arange(12.0).reshape(3, 4), status)
    assert answers.hardest() == (0.2, 3.0, 6.0)
    assert answers.share == 11 / 12


def test_what_a_model_alone_has(monkeypatch):
    finger, shown = Finger.default(), []
    monkeypatch.setattr(page.view, "strain_pictures", lambda *given: shown.append(given) or [b"wide", b"\x89PNG"])
    found = page._of_the_model(
        SimpleNamespace(reduced=prepare(finger), presses=SimpleNamespace(friction="stick")), finger, None
    )
    assert 'srcset="data:image/png;base64,iVBORw=="' in found["strain_picture"], "the narrow one"
    assert 'src="data:image/png;base64,d2lkZQ=="' in found["strain_picture"]
    assert found["default_finger"] is True
    ((of, reduced, press, specimen, _),) = shown
    assert of == finger and press.force == pytest.approx(page.SHOWN_FORCE_N)
    assert press.large_strain and press.friction == np.inf, "the picture is of the press that papilla press makes"
    assert reduced.finger_sha256 == finger.sha256 and specimen.modulus == page.SHOWN_MODULUS_MPA


def test_provenance_names_all_sources(swept):
    rows = dict(provenance(swept.calibration))
    assert rows["finger: name"] == "made up" and rows["mesh: size mm"] == 1.0 and rows["presses"] == 900
    assert rows["versions"].startswith("papilla ") and ", numpy " in rows["versions"]


def test_a_sweep_without_its_finger_is_refused(swept, tmp_path):
    with pytest.raises(InputError, match="needs the finger"):
        write_report(tmp_path / "report.html", replace(swept, reduced=object()))
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("undrawn")
def test_a_model_shows_its_field(swept, read, monkeypatch):
    from papilla.calibration.fitting import page

    finger, reduced = Finger.default(), SimpleNamespace(gains=np.ones(5), levers=np.zeros(5))
    drawn = []
    draw = lambda *given: drawn.append(given[:4]) or [b"a picture", b"narrow"]  # noqa: E731
    monkeypatch.setattr(page.view, "strain_pictures", draw)
    monkeypatch.setattr(page, "cached_press", lambda *given, **options: (given[2], options["force"]))
    found = read(replace(swept, reduced=reduced), finger=finger)
    assert drawn == [(finger, reduced, (Block(0.51, 10.0), 0.588), Block(0.51, 10.0))]
    assert "data:image/png;base64,YSBwaWN0dXJl" in found.images
    assert "The readings are strains, not a foil's output" in found.text
    assert "Outer layer 0.136 MPa, inner layer 0.034 MPa" in found.text and "The papers give no moduli" in found.text


@pytest.mark.usefixtures("undrawn")
def test_a_folder_that_is_not_there_is_refused_in_one_line(swept, tmp_path):
    with pytest.raises(FileAccessError, match="cannot write"):
        write_report(tmp_path / "missing" / "report.html", swept)


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


@pytest.mark.parametrize(
    "value, digits, text",
    [
        (0.0123456, 3, "0.0123"),
        (-12345.6, 5, "−12\u202f346"),
        (2949.9, 3, "2\u202f950"),
        (99.96, 3, "100"),
        (float("nan"), 3, "–"),
        (float("inf"), 3, "∞"),
        (0.0, 2, "0"),
        (3.2e-9, 2, "3.2·10<sup>−9</sup>"),
    ],
)
def test_numbers_are_set_with_their_digits_and_a_real_minus(value, digits, text):
    assert number(value, digits) == text


def test_given_numbers_lose_no_digit_and_gain_none():
    assert [plain(value) for value in (0.05, 1.0, -81.9, 104.5, 2580)] == ["0.05", "1", "−81.9", "104.5", "2\u202f580"]


def test_sentences_are_escaped_and_their_symbols_set():
    assert symbols("a < b & S_d of f2, E2") == "a &lt; b &amp; S<sub>d</sub> of f², E²"


def test_slopes_are_those_of_the_surface(calibration):
    force, rows = slopes(calibration)
    assert force == pytest.approx(0.4903, abs=1e-4)
    assert [modulus for modulus, *_ in rows] == [0.05, 0.089, 0.2, 0.51, 0.72, 2.0, 5.0]
    step = 1e-5
    for modulus, slope, scatter, cost in rows[:-1]:
        rise = np.log(calibration.predict(force, modulus * (1 + step)) / calibration.predict(force, modulus)) / step
        assert slope == pytest.approx(rise, rel=1e-3)
        assert (scatter, cost) == (0, 0)


def test_a_domain_without_50_gf_is_judged_in_its_middle(truth):
    light = fit(truth.sweep(np.geomspace(0.05, 1, 12), np.geomspace(0.05, 0.3, 12)))
    assert slopes(light)[0] == pytest.approx(np.sqrt(0.05 * 0.3))
    assert force_cost(light)[0] == 0.3


def test_the_cost_of_force_is_slope_over_slope(calibration):
    force, rows = force_cost(calibration)
    assert force == 0.5 and [modulus for modulus, _ in rows] == [0.089, 0.51, 0.72]
    for modulus, share in rows:
        along_force, along_modulus = calibration.surface.surface.slopes(force, modulus)
        assert share == pytest.approx(0.01 * along_force / along_modulus, rel=1e-2)


@pytest.mark.slow
def test_the_page_declares_language_charset_and_viewport(swept, tmp_path):
    write_report(tmp_path / "report.html", swept)
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert text.startswith('<!doctype html>\n<html lang="en">')
    assert 'charset="utf-8"' in text and "width=device-width" in text
    assert "<title>Calibration of made up</title>" in text


@pytest.mark.usefixtures("undrawn")
def test_the_first_card_is_the_error_against_physics(swept, made_up, calibration, read):
    force, modulus = np.array([0.3, 0.5, 0.3]), np.array([0.1, 0.3, 0.1])
    sd = np.asarray(calibration.predict(force, modulus)) * [0.999, 0.999, 1.03]
    friction = np.array([math.inf, math.inf, 0.0])
    truth = Truth.of(calibration, np.column_stack([friction, force, modulus, sd]))
    text = read(replace(swept, truth=truth)).text
    cards = text[text.index("MPa.") :]
    stuck = number(100 * np.abs(truth.by("stick").error).max(), 2)
    said = f"{stuck} % largest error of recovered E against presses at finite strain on a mesh it never saw"
    assert cards.index(said) < cards.index("same mesh, no noise")
    assert f"{number(100 * truth.inside.mean(), 3)} % of these 3 presses have their E inside" in text
    assert f"{calibration.dominant.capitalize()} is what E is most uncertain by" in text


def test_the_diagrams_have_forces_and_moduli_of_the_calibration(monkeypatch, swept, calibration):
    drawn, answers = {}, AnswerMap.of(calibration)
    for name in DIAGRAMS:
        monkeypatch.setattr(
            page.view.plots, name, lambda *parts, name=name, **more: drawn.setdefault(name, (parts, more))
        )
    monkeypatch.setattr(page, "both_widths", lambda plot: (b"wide", b"narrow"))
    monkeypatch.setattr(page.cache, "fetch", lambda kind, key, make: make())
    assert set(page._plots(swept, answers, None)) == set(DIAGRAMS)
    force, moduli, sd, _ = drawn["sd_against_force"][0]
    assert sd == pytest.approx(calibration.predict(force[:, None], np.array(moduli)[None, :]))
    assert (force[0], force[-1]) == pytest.approx(calibration.domain["force_N"])
    assert (moduli[0], moduli[-1]) == pytest.approx(calibration.domain["modulus_MPa"]) and moduli == sorted(moduli)
    modulus, forces, sd = drawn["sd_against_modulus"][0]
    assert sd == pytest.approx(calibration.predict(np.array(forces)[:, None], modulus)) and len(forces) == 6
    along, gauges, readings, words = drawn["gauge_readings"][0]
    shown = float(words.removesuffix(" MPa"))
    assert readings == pytest.approx(calibration.predict_readings(along, shown), rel=0.01)
    assert gauges == [gauge.name for gauge in calibration.gauges]
    first, second, sigma, identified, box = drawn["uncertainty_map"][0]
    assert first is answers.force_N and second is answers.modulus_MPa and sigma is answers.relative_sigma
    assert (identified == answers.identified).all() and box == (*page.CHECKED_FORCE_N, *page.CHECKED_MODULUS_MPA)
    recovery = swept.recovery
    assert [part.tolist() for part in drawn["recovery_map"][0][:2]] == [
        recovery.force_N.tolist(), recovery.modulus_MPa.tolist(),
    ]  # fmt: skip
