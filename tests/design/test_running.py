"""Studies from file to page, on a made-up geometry in this process, and on the real one."""

import csv
import json
import math
from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.core.progress import CountedStep
from papilla.core.tables import TableReader
from papilla.design import DesignScene, read_study, run_study
from papilla.design.batch import Batch, Done, check_done, evaluate, version
from papilla.design.job import write_page
from papilla.design.parameters import made
from papilla.design.places import Places
from papilla.design.results import first_words, summary
from papilla.design.running import Price, pool, price
from papilla.model.finger import Finger

FINGER = Finger.default()
GOALS = '["sigma_sd", "signal_over_noise"]'


def table_of(path):
    """Its numbers by column."""
    with TableReader(path, lambda name: name not in ("finger_sha256", "status")) as reader:
        return reader.whole().columns


def test_a_study_becomes_tables_a_page_and_fingers(ran, tmp_path):
    stages = []
    found = ran(('"made up"', "'$\\bad{$ <b>'"), progress=stages.append)
    told = summary(found)
    json.dumps(told)
    assert (told["designs"], told["failed"], told["reused"]) == (12, 0, 0)
    done = [step.done for step in stages if isinstance(step, CountedStep)]
    assert done == sorted(done) and done[-1] == 12 and found.tally.spent["scenes"] > 0
    columns = table_of(tmp_path / "out" / "designs.csv")
    assert len(columns["design"]) == 12 and columns["front"].sum() == told["front"]
    best = told["best"][0]["objectives"]["sigma_sd"]
    assert best == columns["sigma_sd"].min() and best < told["base"]["sigma_sd"]
    write_page(tmp_path / "study.html", found, fields=False)
    page = (tmp_path / "study.html").read_text()
    assert "multiplies sigma_sd by" in page and "finger_1.toml" in page and "data:image" in page
    assert r"<h1>$\bad{$ &lt;b&gt;</h1>" in page


def test_the_written_fingers_are_those_that_were_judged(ran, made_up, tmp_path):
    """Bit for bit: the hash of a design is that of its row, of its file and in JSON."""
    formula = "sqrt(outer.modulus_MPa * 0.1) / 3 + min(gauges.lever_mm / 1e4, 0.003)"
    study = made_up(("outer.modulus_MPa / 4", formula))
    best = summary(ran(study=study))["best"]
    with open(tmp_path / "out" / "designs.csv", newline="") as file:
        rows = {int(row["design"]): row for row in csv.DictReader(file)}
    assert best and len({row["finger_sha256"] for row in rows.values()}) == len(rows) == 12
    for one in best:
        finger = Finger.load(one["finger"])
        assert finger.sha256 == one["finger_sha256"] == rows[one["design"]]["finger_sha256"]
        assert finger.sha256 == study.finger_of(one["free"]).sha256
    assert not (tmp_path / "out" / "study.html").exists()


def test_a_run_that_stopped_goes_on_and_other_names_share_what_is_known(ran, made_up, tmp_path):
    shared = 'name = "made up"', f'name = "made up"\nstore = "{tmp_path / "shared.sqlite"}"'

    class StoppedError(Exception): ...

    def stop(step):
        if isinstance(step, CountedStep):
            raise StoppedError

    with pytest.raises(StoppedError):
        ran(shared, progress=stop)
    first, again = ran(shared, out="a"), ran(shared, ("made up", "another name"), out="b")
    assert first.tally.reused == again.tally.reused == 12, "what was stored before the stop is not run again"
    np.testing.assert_array_equal(first.results.found, again.results.found)
    other = ran(shared, ("[sampler]", "[scene]\nsamples = 50\n[sampler]"), out="c")
    assert other.tally.reused == 0 and not np.array_equal(other.results.found, first.results.found)
    with pytest.raises(InputError, match="--resume"):
        ran(out="d"), ran(out="d")
    assert ran(out="d", resume=True).tally.reused == 12


def test_failed_designs_are_rows_and_many_are_said_first(ran, tmp_path):
    found = ran(("[0.1, 0.6]", "[0.1, 6.0]"))
    assert found.failed_share > 0.1 and "designs failed" in first_words(found)[0]
    text = (tmp_path / "out" / "designs.csv").read_text()
    assert "leaves what the model covers" in text and text.count("\n") == 13
    with pytest.raises(InputError, match="none of the 12 designs.*outer over inner modulus is 40"):
        ran(('"outer.modulus_MPa / 4"', '"outer.modulus_MPa / 40"'), out="none")


def test_an_optimiser_does_better_than_its_start_and_keeps_a_limit(ran):
    found = ran(
        ("designs = 12", 'kind = "optimise"\ndesigns = 48'),
        ("[sampler]", "[constraints]\nsignal_over_noise = { least = 8000 }\n[sampler]"),
    ).results
    sd, signal, best = found.values("sigma_sd"), found.values("signal_over_noise"), found.chosen[0]
    assert (found.feasible == (signal >= 8000)).all() and signal[best] >= 8000
    assert not found.feasible.all() and found.feasible[-12:].mean() > found.feasible[:12].mean()
    assert sd[best] == sd[found.feasible].min() <= sd[found.feasible][:6].min()


def test_a_price_is_of_the_designs_and_geometries_of_the_study(made_up):
    said = []
    found = price(made_up(), said.append)
    assert (found.designs, found.geometries, found.sites) == (12, 1, 5) and found.per_design > 0
    assert found.cached and said == ["reducing one geometry"]


@pytest.mark.slow
def test_a_real_study_finds_what_physics_says(study_file, tmp_path):
    """A harder finger strains less, and tells hard specimens better; processes give what this process gives."""
    study = read_study(study_file(own=True))
    here, there = (run_study(study, tmp_path / str(k), workers=k, with_page=False) for k in (0, 2))
    np.testing.assert_allclose(here.results.found, there.results.found, rtol=1e-9)
    effects = {(one.parameter, one.objective): one for one in here.results.effects}
    signal, sigma = (effects["outer.modulus_MPa", goal] for goal in ("signal_over_noise", "sigma_sd"))
    assert signal.sure and signal.change == pytest.approx(1 / 6, rel=0.5), "strain falls nearly as stiffness rises"
    assert sigma.sure and sigma.change < 1
    assert all("specimen of 0.05 MPa is too soft" in why for why in here.results.failures.values())


def test_a_batch_of_another_version_is_left_to_others(made_up_geometry):
    batch = Batch((FINGER,), FINGER, Places.of(FINGER), DesignScene(), ("sigma_sd",), "0.0 (old)", made_up_geometry)
    assert evaluate(batch) == Done((), version(), {}, 0.0)
    stiff = replace(FINGER, outer=replace(FINGER.outer, modulus=90.0))
    done = evaluate(replace(batch, fingers=(FINGER, stiff), version=version()))
    good, bad = done.records
    assert good.status == "ok" and set(good.found) == {"sigma_sd"} and "a study covers" in bad.status
    assert set(done.spent) == {"gauges", "scenes"} and 10 < done.memory_MB < 1e5
    with pytest.raises(InputError, match=r"^a worker has papilla 0\.0, this client has "):
        check_done(replace(done, version="0.0"), batch)

    def no_geometry(*_places):
        raise InputError("no mesh")

    failed = evaluate(replace(batch, fingers=(FINGER, stiff), version=version(), geometry=no_geometry))
    assert [(one.status, one.finger_sha256) for one in failed.records] == [("no mesh", FINGER.sha256),
                                                                           ("no mesh", stiff.sha256)]  # fmt: skip
    check_done(failed, replace(batch, fingers=(FINGER, stiff)))


def of_record(**values):
    """Changes of the first record that a worker sends."""
    return lambda done: replace(done, records=(replace(done.records[0], **values), *done.records[1:]))


FORGED = {
    "nothing": lambda done: None,
    "a list of records": lambda done: replace(done, records=list(done.records)),
    "a record too few": lambda done: replace(done, records=done.records[1:]),
    "no record": lambda done: replace(done, records=(done.records[0], {"sigma_sd": 0.1})),
    "an old version": lambda done: replace(done, version="0.0.9 (abc)"),
    "another finger": lambda done: replace(done, records=done.records[::-1]),
    "no number of seconds": lambda done: replace(done, spent={"scenes": math.nan}),
    "no memory": lambda done: replace(done, memory_MB="much"),
    "no number": of_record(found={"sigma_sd": math.nan}),
    "another objective": of_record(found={"sigma_gauges": 0.1}),
    "no table": of_record(found=[0.1]),
    "two lines": of_record(found={}, status="no\nmesh"),
    "no reason": of_record(found={}, status=""),
    "no hash": of_record(finger_sha256="f"),
}


@pytest.mark.parametrize("forge", FORGED.values(), ids=FORGED)
def test_what_a_worker_sends_is_checked(made_up_geometry, forge):
    other = made(FINGER, {"outer.modulus_MPa": 0.3})
    batch = Batch((FINGER, other), FINGER, Places.of(FINGER), DesignScene(), ("sigma_sd",), version(), made_up_geometry)
    done = evaluate(batch)
    check_done(done, batch)
    with pytest.raises(InputError) as refused:
        check_done(forge(done), batch)
    assert "\n" not in str(refused.value) and len(str(refused.value)) < 1000


@pytest.mark.parametrize("workers, how", [(0, "this process"), (1, "1 process on this machine"),
                                          (2, "2 processes on this machine")])  # fmt: skip
def test_a_pool_says_what_it_is(workers, how):
    with pool(workers, None) as made_pool:
        assert (made_pool.workers, made_pool.how) == (max(workers, 1), how)
        if not workers:
            assert made_pool.executor.submit(divmod, 7, 2).result() == (3, 1)
            with pytest.raises(ZeroDivisionError):
                made_pool.executor.submit(divmod, 7, 0).result()


@pytest.mark.parametrize("geometries, workers, seconds", [(1, 1, 20.0), (3, 1, 36.0), (3, 2, 18.0)])
def test_the_geometry_that_was_measured_costs_nothing_more(geometries, workers, seconds):
    one = Price(100, geometries, sites=5, per_design=0.2, per_geometry=8.0, cached=False)
    assert one.seconds(workers) == pytest.approx(seconds)


def test_progress_counts_the_designs_and_the_tally_names_how_they_ran(ran):
    steps = []
    tally = ran((GOALS, '["signal_over_noise"]'), ("designs = 12", "designs = 60"), progress=steps.append).tally
    counts = [step for step in steps if isinstance(step, CountedStep)]
    assert all(step.total == 60 for step in counts) and counts[-1].done == 60 and "left" not in counts[-1]
    assert [step.done for step in counts] == sorted({step.done for step in counts})
    assert (tally.designs, tally.failed, tally.reused) == (60, 0, 0) and tally.notes == []
    assert tally.seconds > 0 and (tally.workers, tally.how) == (1, "this process")


def test_an_optimiser_ends_at_a_limit_beyond_which_its_goal_would_be_better(ran):
    bound = 3500
    found = ran(
        (GOALS, '["signal_over_noise"]'), ("designs = 12", 'kind = "optimise"\ndesigns = 48\nseed = 3'),
        ("[sampler]", f"[constraints]\nsignal_over_noise = {{ most = {bound} }}\n[sampler]"),
    ).results  # fmt: skip
    signal = found.values("signal_over_noise")
    assert (found.feasible == (signal <= bound)).all() and 0.95 * bound < signal[found.chosen[0]] <= bound
    away = np.abs(signal - bound)
    assert away[-12:].mean() < 0.25 * away[:6].mean()


def test_the_table_of_designs_is_what_the_results_hold(ran, tmp_path):
    found = ran(("[0.1, 0.6]", "[0.1, 6.0]"),
                ("[sampler]", "[constraints]\nsignal_over_noise = { least = 3000 }\n[sampler]")).results  # fmt: skip
    columns = table_of(tmp_path / "out" / "designs.csv")
    assert columns["design"].tolist() == list(range(12))
    good = np.isin(columns["design"], found.numbers)
    assert good.sum() == 12 - len(found.failures) < 12 and np.isnan(columns["sigma_sd"][~good]).all()
    for name in ("sigma_sd", "signal_over_noise"):
        assert columns[name][good].tolist() == found.values(name).tolist()
    for k, name in enumerate(found.study.free_names):
        assert columns[name][good].tolist() == found.free[:, k].tolist()
    for name, flags in (("feasible", found.feasible), ("front", found.front)):
        assert columns[name][good].tolist() == flags.tolist() and not columns[name][~good].any()
