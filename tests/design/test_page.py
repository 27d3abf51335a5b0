"""The page of a study: what its template is given, and what its figures show."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.axes import Axes

from papilla.core.errors import InputError
from papilla.design import job, placement
from papilla.design.results import Results
from papilla.design.running import Tally
from papilla.design.study import read_study
from papilla.model.finger import Finger

FINGER = Finger.default()


@pytest.fixture
def given(monkeypatch):
    """What the template of a page is given, and the maps of sigma; nothing is drawn."""
    seen = {"maps": []}
    template = SimpleNamespace(render=lambda **how: seen.update(how) or "the page")
    monkeypatch.setattr(job, "environment", lambda package: SimpleNamespace(get_template=lambda name: template))
    monkeypatch.setattr(job, "image", lambda figure, words: (figure, words))
    monkeypatch.setattr(job, "front_figure", lambda results, base: ("front", base))
    monkeypatch.setattr(job, "sigma_figure", lambda *maps: seen["maps"].append(maps) or "sigma")
    monkeypatch.setattr(job, "_strain", lambda finger, outcome, say: finger.outer.modulus)
    return seen


def outcome_of(study, feasible=True, count=15):
    """Fifteen designs on the front, the last the best in the first objective; one is worse than all."""
    found = np.array([(0.5 - 0.01 * k, 10.0 - 0.1 * k) for k in range(count)] + [(0.51, 1.0)])
    spread = 35 + 15 * np.sin(np.arange(count + 1))
    free = np.column_stack([[*np.linspace(0.12, 0.6, count), 0.1], spread])
    results = Results(
        study, np.arange(100, 101 + count), free, found, np.full(count + 1, feasible), [""] * (count + 1), {}
    )
    base = {"sigma_sd": 0.4, "signal_over_noise": 3.0}
    return SimpleNamespace(study=study, results=results, tally=Tally(), base=base, failed_share=0.0)


def test_the_page_of_a_study_has_its_front_and_its_maps(given, made_up, study_file, tmp_path, monkeypatch):
    monkeypatch.setattr(job, "_strain", lambda finger, outcome, say: finger.outer.modulus)
    study, said = read_study(study_file()), []
    outcome = outcome_of(study)
    job.write_page(tmp_path / "p.html", outcome, said.append)
    assert (tmp_path / "p.html").read_text() == "the page" and said == ["pictures of the page"]
    # The best in the first objective, twelve of fifteen
    assert given["front"] == list(range(14, 2, -1)) and given["on_front"] == 15
    assert given["chosen"] == [(row, 100 + row) for row in outcome.results.chosen] and given["chosen"][0] == (14, 114)
    best = outcome.results.finger(14)
    assert given["strains"] == [("finger_1.toml", best.outer.modulus), (FINGER.name, FINGER.outer.modulus)]
    assert given["figures"]["front"][0] == ("front", outcome.base) and given["figures"]["sigma"][0] == "sigma"
    ((forces, moduli, panels),) = given["maps"]
    assert (len(forces), len(moduli)) == (7, 9) and (forces[0], forces[-1]) == pytest.approx(study.scene.force_N)
    assert (moduli[0], moduli[-1]) == pytest.approx(study.scene.modulus_MPa)
    assert [(name, sigma.shape) for name, sigma in panels] == [("finger_1.toml", (7, 9)), (FINGER.name, (7, 9))]
    assert given["said"][0].endswith(f"best 0.36, {FINGER.name} 0.4")
    assert len(given["effects"]) == sum(one.sure for one in outcome.results.effects) > 0


def test_a_page_without_a_best_design_or_a_map(given, made_up, study_file, tmp_path, monkeypatch):
    monkeypatch.setattr(job, "_strain", lambda finger, outcome, say: finger.outer.modulus)
    study = read_study(study_file())
    job.write_page(tmp_path / "p.html", outcome_of(study, feasible=False))
    assert given["chosen"] == [] == given["front"] and [name for name, _ in given["strains"]] == [FINGER.name]
    assert [name for name, _ in given["maps"][0][2]] == [FINGER.name]

    def refuse(*_):
        raise InputError("outside")

    monkeypatch.setattr(job, "_strain", lambda *_: None)
    one = replace(study, finger=replace(FINGER, gauges=FINGER.gauges[:1]))
    job.write_page(tmp_path / "p.html", outcome_of(one))
    assert "sigma" not in given["figures"] and len(given["maps"]) == 1, "one gauge has no S_d"
    monkeypatch.setattr(job, "sigma_figure", refuse)
    job.write_page(tmp_path / "p.html", outcome_of(study))
    assert "sigma" not in given["figures"] and "front" in given["figures"] and given["strains"] == []


def test_maps_of_sigma_are_in_per_cent_from_1_to_100(monkeypatch):
    drawn, contourf = [], Axes.contourf

    def record(axes, x, y, z, **how):
        drawn.append((x, y, z, how["levels"]))
        return contourf(axes, x, y, z, **how)

    monkeypatch.setattr(Axes, "contourf", record)
    forces, moduli = np.geomspace(0.2, 0.8, 3), np.geomspace(0.1, 0.4, 2)
    sigma = np.array([[0.001, 0.01], [0.05, 0.5], [1.0, 3.0]])
    title = "a name of more than eighteen letters"
    left, right, _ = job.sigma_figure(forces, moduli, [(title, sigma), ("two", sigma)]).axes
    x, y, z, levels = drawn[0]
    assert (x is forces, y is moduli) == (True, True) and levels == pytest.approx(np.log10([1, 2, 5, 10, 20, 50, 100]))
    assert pytest.approx(np.log10([[1, 1], [5, 50], [100, 100]])) == z.T
    assert left.get_title(loc="left") == "a name of more\nthan eighteen\nletters"
    assert (left.get_ylabel(), right.get_ylabel()) == ("modulus of the specimen (MPa)", "")
    assert left.get_xlabel() == right.get_xlabel() == "force (N)"
    assert left.get_shared_y_axes().joined(left, right) and not left.get_shared_x_axes().joined(left, right)


@pytest.mark.parametrize("wide, scale", [(4.9, "linear"), (5.1, "log")])
def test_an_axis_is_logarithmic_from_a_ratio_of_five(wide, scale):
    values = {"a": np.array([1.0, 2.0, wide]), "b": np.array([-1.0, 3.0, 20.0])}
    goals = [SimpleNamespace(name=name, unit="1") for name in values]
    study = SimpleNamespace(objectives=goals, free=[SimpleNamespace(name="x")], finger=SimpleNamespace(name="own"))
    results = SimpleNamespace(
        study=study, values=values.get, free=np.zeros((3, 1)), chosen=[0, 2], feasible=np.ones(3, bool),
        front=np.zeros(3, bool),
    )  # fmt: skip
    (axes,) = job.front_figure(results, {"a": 1.0, "b": 1.0}).axes
    assert (axes.get_yscale(), axes.get_xscale()) == (scale, "linear"), "negative values have no logarithm"
    chosen = next(line for line in axes.lines if line.get_label() == "chosen")
    assert chosen.get_markersize() == 13 and chosen.get_marker() == "*" and axes.get_legend() is not None


def test_axes_of_a_placement(monkeypatch):
    gauge = FINGER.gauges[0]
    found = SimpleNamespace(gauges=[gauge, gauge], sites=np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]))
    sigma = {kind: {name: [0.5, 0.25] for name in placement.UNKNOWN} for kind in ("anywhere", "in a row")}
    one = SimpleNamespace(found=found, sets=[[0], [0, 1]], rows=[[0], [0, 1]], sigma=sigma)
    (axes,) = placement.sigma_figure(one).axes
    assert axes.get_ylim()[0] == 0 and axes.get_xlabel() == "gauges" and len(axes.get_legend().get_texts()) == 5
    figure = placement.places_figure(one)
    (axes,) = figure.axes
    assert figure.get_size_inches()[1] == pytest.approx(5.6) and axes.get_aspect() == 1.0
