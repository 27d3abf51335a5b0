"""Studies from file to page, in this process, on a made-up geometry."""

import csv
import json

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.core.tables import TableReader
from papilla.design.job import run_study
from papilla.design.results import Results, first_words, summary
from papilla.design.study import read_study
from papilla.model.finger import Finger

pytestmark = pytest.mark.usefixtures("made_up")


def test_a_study_becomes_tables_a_page_and_fingers(study_file, tmp_path):
    study = read_study(study_file())
    found = run_study(study, tmp_path / "out", workers=0)
    told = summary(found)
    json.dumps(told)
    assert told["designs"] == 12 and told["failed"] == 0
    with TableReader(tmp_path / "out" / "designs.csv", lambda name: name not in ("finger_sha256", "status")) as reader:
        table = reader.whole()
    assert len(table) == 12 and table.columns["front"].sum() == told["front"]
    best = told["best"][0]["objectives"]["sigma_sd"]
    assert best == table.columns["sigma_sd"].min() and best < told["base"]["sigma_sd"]
    page = (tmp_path / "out" / "study.html").read_text()
    assert "multiplies sigma_sd by" in page and "finger_1.toml" in page
    assert Finger.load(tmp_path / "out" / "finger_1.toml").outer.modulus == pytest.approx(
        told["best"][0]["free"]["outer.modulus_MPa"]
    )


def test_the_written_fingers_are_those_that_were_judged(study_file, tmp_path):
    """Bit for bit: the hash of a design is that of its row, of its file and in JSON."""
    formula = "sqrt(outer.modulus_MPa * 0.1) / 3 + min(gauges.spread_deg / 1e4, 0.003)"
    named = '"made up"', "'$\\bad{$ <b>'"
    study = read_study(study_file(("outer.modulus_MPa / 4", formula), named))
    best = summary(run_study(study, tmp_path / "out", workers=0))["best"]
    with open(tmp_path / "out" / "designs.csv", newline="") as file:
        rows = {int(row["design"]): row for row in csv.DictReader(file)}
    assert best and len({row["finger_sha256"] for row in rows.values()}) == len(rows) == 12
    for one in best:
        finger = Finger.load(one["finger"])
        assert finger.sha256 == one["finger_sha256"] == rows[one["design"]]["finger_sha256"]
        assert finger.sha256 == study.finger_of(one["free"]).sha256
    assert r"<h1>$\bad{$ &lt;b&gt;</h1>" in (tmp_path / "out" / "study.html").read_text()


def test_the_front_holds_what_nothing_beats(study_file, tmp_path):
    study = read_study(study_file())
    found = run_study(study, tmp_path / "out", workers=0).results
    for row, cost in enumerate(found.costs):
        beaten = any((other <= cost).all() and (other < cost).any() for other in found.costs)
        assert found.front[row] == (not beaten)


def test_a_folder_with_results_is_not_overwritten_by_chance(study_file, tmp_path):
    study = read_study(study_file())
    run_study(study, tmp_path / "out", workers=0)
    with pytest.raises(InputError, match="--resume"):
        run_study(study, tmp_path / "out", workers=0)
    assert run_study(study, tmp_path / "out", workers=0, resume=True).tally.reused == 12


def test_failed_designs_are_rows_and_many_are_said_first(study_file, tmp_path):
    study = read_study(study_file(("[0.1, 0.6]", "[0.1, 6.0]")))
    found = run_study(study, tmp_path / "out", workers=0)
    assert found.failed_share > 0.1 and "designs failed" in first_words(found)[0]
    text = (tmp_path / "out" / "designs.csv").read_text()
    assert "leaves what the model covers" in text and text.count("\n") == 13


def test_no_answer_at_all_is_refused(study_file, tmp_path):
    study = read_study(study_file(('"outer.modulus_MPa / 4"', '"outer.modulus_MPa / 40"')))
    with pytest.raises(InputError, match="none of the 12 designs.*outer over inner modulus is 40"):
        run_study(study, tmp_path / "out", workers=0)


def test_an_optimiser_does_better_than_its_start_and_keeps_a_limit(study_file, tmp_path):
    changes = (
        ("designs = 12", 'kind = "optimise"\ndesigns = 48'),
        ("[sampler]", "[constraints]\nsignal_over_noise = { least = 100 }\n[sampler]"),
    )
    study = read_study(study_file(*changes))
    found = run_study(study, tmp_path / "out", workers=0).results
    best = found.chosen[0]
    assert found.values("sigma_sd")[best] <= found.values("sigma_sd")[found.feasible][:6].min()
    assert found.values("signal_over_noise")[best] >= 100


def test_effects_find_what_was_put_in(study_file):
    study = read_study(study_file())
    rng = np.random.default_rng(1)
    free = np.column_stack([0.1 * 6 ** rng.random(200), 20 + 30 * rng.random(200)])
    sigma = free[:, 0] ** -0.5 * np.exp(0.05 * rng.standard_normal(200))
    found = np.column_stack([sigma, np.full(200, 3.0) + rng.random(200)])
    results = Results(study, np.arange(200), free, found, np.ones(200, bool), [""] * 200, {})
    effect = results.effects[0]
    assert (
        effect.interval[0] < 6**-0.5 < effect.interval[1]
        and effect.sure
        and effect.change == pytest.approx(6**-0.5, rel=0.05)
    )
    assert not results.effects[1].sure
