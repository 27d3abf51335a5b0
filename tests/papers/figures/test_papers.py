"""What each figure shows holds: curves that rise, ratios, printed points beside them."""

import numpy as np
import pytest

from papilla.core.units import INCH_MM
from papilla_papers.figures import Picture, paper_2006, paper_2007, paper_oddo, paper_okamoto, paper_textiles
from papilla_papers.figures.runner import ALL_PAPERS


def curves(picture: Picture, panel: int) -> dict:
    return {one.label: one for one in picture.panels[panel].curves}


@pytest.mark.slow
def test_two_grooves_give_two_impulses_at_their_entries():
    made = paper_2006.two_grooves()
    impulses, printed = made.panels[4].curves
    assert len(impulses.x) == 4, "two edges a groove"
    assert impulses.x[2] - impulses.x[0] == pytest.approx(paper_2006.IMPULSE_FIGURES.two_grooves.apart_s, abs=0.002)
    assert printed.x == pytest.approx(impulses.x[[0, 2]], abs=0.003)
    assert len(made.panels[5].curves[0].x) > 8, "a finger feels every edge with every ridge"


def test_passive_touch_follows_the_step_and_its_phases():
    made = paper_oddo.passive_maps()
    across, along = made.panels[4].shade, made.panels[3].shade
    for shade, expected in ((across, 0.0), (along, np.angle(np.exp(-2j * np.pi * 2.36 / 0.48)))):
        for time, frequency in ((1.6, 13.9), (2.4, 20.8)):
            column = int(np.argmin(np.abs(shade.x - time)))
            row = int(np.nanargmax(shade.value[:, column]))
            assert shade.y[row] == pytest.approx(frequency, rel=0.03) and shade.over[row, column]
            assert abs(np.angle(np.exp(1j * (abs(shade.phase[row, column]) - abs(expected))))) < 0.15


def test_an_active_rub_is_felt_by_one_row_before_the_other():
    felt = paper_oddo.active_record().panels[0].curves
    fourth, first, second = (float(one.x[np.flatnonzero(np.abs(one.y) > 0.5)[0]]) for one in felt)
    begins = first, second, fourth
    assert begins[0] == pytest.approx(begins[1], abs=0.01) and begins[2] - begins[0] == pytest.approx(0.035, abs=0.015)
    panels = paper_oddo.active_maps().panels
    assert all(one.curves[0].label == "t_MP" for one in panels[3:]) and len(panels) == 5


@pytest.mark.slow
def test_gratings_are_clusters_and_a_nearest_neighbour_names_them():
    made = paper_oddo.clusters()
    centres = [one.x.mean() for one in made.panels[0].curves if one.label]
    assert np.all(np.diff(centres) < -2) and len(centres) == 3
    table = paper_oddo.neighbours().table.rows
    assert [row[-1] for row in table][-1] == "97.6" and table[-1][3] > 95 and table[-1][5] < 90


def test_statistics_of_active_touch_scatter_more_than_those_of_passive_touch():
    passive, active = (np.array([row[-4:] for row in made().table.rows], float) for made in
                       (paper_oddo.passive_table, paper_oddo.active_table))  # fmt: skip
    assert (passive[:, 1] / passive[:, 0]).max() < 0.016
    assert 0.05 < (active[:, 1] / active[:, 0]).max() < 0.12
    assert np.all(active[:, 2] > active[:, 0]) and np.all(active[:, 0] > active[:, 3])
    expected = paper_oddo.expected().table.rows
    assert expected[2][1] == pytest.approx(float(expected[2][2]), abs=0.05)


def test_every_textile_has_its_own_pattern():
    made = paper_oddo.textiles()
    shapes = [panel.shade.value.ravel() for panel in made.panels]
    related = np.corrcoef(shapes) - np.eye(len(shapes))
    assert len(shapes) == 5 and related.max() < 0.9


def test_the_tables_of_textiles_are_the_printed_ones():
    weights = np.array([row[2:5] for row in paper_textiles.fabrics().table.rows], float)
    agree = np.abs(weights[:, 1] / weights[:, 0] - 1) < 0.07
    assert agree.tolist() == [True, False, True, True] and (weights[:, 2] < 0.35 * weights[:, 0]).all()
    made = paper_textiles.grid()
    assert [row[1] for row in made.table.rows] == list(paper_textiles.PRINTED_BANDS) and "11770" in made.found


@pytest.mark.slow
class TestSlides:
    """Figures of sliding scenes by finite elements."""

    def test_five_gratings(self):
        synthetic, felt = paper_2006.five_gratings().panels
        means = [np.nanmean(one.y) for one in synthetic.curves if one.origin == "papilla"]
        assert means[1] > means[2] > means[3], "2.4, 1.8 and 1.2 mm stay apart"
        assert len(felt.curves) == 10

    def test_depths(self):
        made = paper_2006.depths()
        force, _, printed = made.panels[1].curves
        assert np.all(np.diff(force.y) > 0)
        assert np.interp(printed.x, force.x, force.y) == pytest.approx(printed.y, rel=0.5)

    def test_natural_touch(self):
        touch = curves(paper_2006.natural_touch(), 1)
        truth, told = touch["|v| / wavelength"], touch["synthetic"]
        rows = slice(1000, None)
        late = [np.nanmean(told.y[rows] * np.roll(truth.y, lag)[rows]) for lag in range(0, 250, 10)]
        assert 20 <= 10 * int(np.argmax(late)) <= 160, "it follows late"
        single = curves(paper_2006.single_intervals(), 0)["synthetic"].y[rows]
        steps = [np.nanmean(np.diff(one) ** 2) for one in (single, told.y[rows])]
        assert steps[0] > 100 * steps[1], "single intervals flicker"
        assert len(paper_2006.against_spectrum().panels) == 2

    def test_contacts_and_spread(self):
        hard, soft, _ = paper_2006.contacts().panels
        assert soft.shade.over.sum() > 1.2 * hard.shade.over.sum() and hard.shade.value.max() > soft.shade.value.max()
        over_force = paper_2006.spread().panels[0].curves
        model = [one for one in over_force if one.origin == "papilla"]
        assert all(np.all(np.diff(one.y) > 0) for one in model)
        assert np.all(model[0].y < model[1].y) and np.all(model[1].y < model[2].y)

    def test_zero_crossings(self):
        output, impulses = paper_2007.crossings().panels
        (train,) = impulses.curves
        assert len(train.x) / 0.4 > 33 and np.ptp(output.curves[0].y) > 100
        told = curves(paper_2007.side_by_side(), 1)["synthetic"]
        before, after = told.y[600:900], told.y[1300:]
        assert np.nanmedian(before) == pytest.approx(1, rel=0.1) and np.nanmedian(after) == pytest.approx(4, rel=0.1)

    def test_okamoto(self):
        match, synthetic, felt = paper_okamoto.wavelengths().panels[0].curves
        assert np.abs(synthetic.y / match.x.max() - synthetic.x / match.x.max()).max() < 0.1
        assert np.all(np.diff(synthetic.spread[1:]) > 0) and felt.y[1] == pytest.approx(1.0, rel=0.2)
        speed = paper_okamoto.power_over_speed().panels[0].curves
        assert [np.log(one.y).max() - np.log(one.y).min() < 2 for one in speed].count(True) == len(speed)
        points, quartic, *_ = paper_okamoto.power_over_wavelength().panels[0].curves
        assert 1.0 < points.x[np.argmax(points.y)] < 1.6 and "R²" in quartic.label

    def test_displays(self):
        late = curves(paper_okamoto.with_delay(), 0)
        at_once = curves(paper_okamoto.without_delay(), 0)
        match = at_once["match"].x
        assert at_once["local model"].y[[0, -1]] == pytest.approx(match, rel=0.03)
        assert late["local model, delayed"].y[[0, -1]] == pytest.approx(match, rel=0.03)
        assert np.nanmean(np.abs(late["direct, delayed"].y / late["direct, delayed"].x - 1)) > 0.2
        lags = paper_okamoto.with_delay().panels[2].curves
        assert np.nanmedian(lags[0].y) > paper_okamoto.NOTICED_MS > 5 > abs(np.nanmedian(lags[1].y))
        assert len(paper_okamoto.signals().table.rows) == 28

    def test_textiles(self):
        made = paper_textiles.vibration()
        halves = [10 / (2 * INCH_MM / one.yarns[0]) for one in paper_textiles.PRINTED_FABRICS.values()]
        tops = [one.x[10:][np.argmax(one.y[10:])] for one in made.panels[1].curves]
        assert sum(abs(top / line - 1) < 0.1 for top, line in zip(tops[1:3], halves[1:3], strict=True)) >= 1
        for panel in paper_textiles.bands().panels:
            bars = panel.curves[0]
            assert bars.y[6] > bars.y[5] and bars.y[6] > bars.y[7]
            assert panel.names[6] in ("18-118", "19-119", "20-120"), "the lowest and widest of the grid, or next to it"
        for panel in paper_textiles.contour().panels:
            assert np.nanmax(panel.shade.value) == panel.shade.value[-1, 0] > 0
        *heard, rough = paper_textiles.agreement().panels[0].curves
        assert all(one.y.max() == 1 for one in (*heard, rough)) and len(heard) == 2
        assert np.corrcoef(heard[1].y, rough.y)[0, 1] > 0.5, "by finite elements rougher weaves are louder"
        assert np.argmax(paper_textiles.roughness().panels[0].curves[0].y) == 3


def test_every_paper_has_figures():
    assert {name: len(paper.figures) for name, paper in ALL_PAPERS.items()}.keys() >= {"2006", "2007", "textiles"}
    assert sum(len(paper.figures) for paper in ALL_PAPERS.values()) >= 35
