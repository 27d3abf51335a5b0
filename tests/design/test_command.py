"""`papilla design` on a made-up geometry: what it says, what it refuses, what it writes."""

import json
from types import SimpleNamespace

import pytest

from papilla.cli import main
from papilla.cli.options import PROCESSES
from papilla.design import running
from papilla.design.cluster import Scheduler
from papilla.design.running import price
from papilla.design.study import read_study
from papilla.model.finger import Gauge

pytestmark = pytest.mark.usefixtures("made_up")


@pytest.fixture
def papilla(capsys, monkeypatch):
    """Runs the command in this process, the study too: exit code, stdout, stderr."""
    true = running.run
    monkeypatch.setattr("papilla.design.job.run", lambda *given, **how: true(*given, **how | {"workers": 0}))

    def run(*arguments):
        with pytest.raises(SystemExit) as left:
            main.run(["design", *map(str, arguments)])
        out, said = capsys.readouterr()
        return left.value.code, out, said

    return run


def test_a_study_as_json_and_as_text(papilla, study_file, tmp_path):
    code, out, _ = papilla(study_file(), "--out", tmp_path / "a", "--json")
    found = json.loads(out)
    assert code == 0 and found["designs"] == 12 and found["objectives"] == ["sigma_sd", "signal_over_noise"]
    assert set(found["best"][0]) == {"design", "finger", "finger_sha256", "free", "objectives"}
    code, out, said = papilla(study_file(), "--out", tmp_path / "b")
    assert code == 0 and "finger_1.toml" in out and "12 of 12" in said


@pytest.mark.parametrize(
    "options, said",
    [
        (["--workers", "0"], "--workers must be from 1"),
        (["--workers", "1", "--scheduler", "tcp://host:1"], "not both"),
        (["--scheduler", "tcp://host:1"], "tcp://host:1 is open: whoever reaches it runs code as you"),
        (["--scheduler", "host:1"], "host:1 is open: whoever reaches it runs code as you"),
        (["--scheduler", "tls://host:1"], "needs --tls-ca, --tls-cert and --tls-key"),
        (["--scheduler", "tls://host:1", "--insecure"], "give one of them"),
        (
            ["--scheduler", "tcp://host:1", "--insecure", "--tls-ca", "ca.pem"],
            "need an address that begins with tls://",
        ),
        (["--scheduler", "ucx://host:1", "--insecure"], "must be an address that begins with tls://, got ucx://host:1"),
        (["--scheduler", "tcp://host\n:1", "--insecure"], "must be an address such as tls://host:8786"),
        (["--insecure"], "are for --scheduler"),
        (["--tls-key", "key.pem"], "are for --scheduler"),
        (["--place", "9"], "--place must be from 1 to 8"),
    ],
)
def test_bad_options_are_one_line(papilla, study_file, options, said):
    code, out, line = papilla(study_file(), *options)
    assert code == 2 and out == "" and said in line and line.count("\n") == 1


def test_a_bad_study_is_one_line(papilla, study_file):
    code, _, line = papilla(study_file(("spread_deg", "spread")))
    assert code == 2 and "did you mean 'gauges.spread_deg'" in line and line.count("\n") == 1


def test_explain_says_what_a_study_costs_and_runs_nothing(papilla, study_file, tmp_path):
    code, out, _ = papilla(study_file(), "--explain", "--out", tmp_path / "out")
    assert code == 0 and "12 designs of 1 geometries, gauges at 17 places" in out
    assert not (tmp_path / "out").exists()
    found = price(read_study(study_file()), lambda line: None)
    assert found.seconds(2) == pytest.approx(found.seconds(1) / 2) and found.per_design > 0


def test_placed_gauges_are_listed_and_given_as_json(papilla, study_file, monkeypatch, tmp_path):
    asked = []

    def placed(study, count, out, say):
        asked.append((len(study.free), count, out))
        gauges = (Gauge("g1", angle_deg=-7.5), Gauge("g2", angle_deg=20.0, y_mm=3.0, direction_deg=90.0))
        return SimpleNamespace(
            sets=[[3], [3, 8]], of=lambda chosen: SimpleNamespace(gauges=gauges[: len(chosen)]),
            sentences=["two gauges leave 0.2"], sigma={"anywhere": {}}, written=["placed_2.toml"],
        )  # fmt: skip

    monkeypatch.setattr("papilla.design.placement.place_gauges", placed)
    code, out, _ = papilla(study_file(), "--place", "2", "--out", tmp_path, "--json")
    found = json.loads(out)
    assert code == 0 and found["written"] == ["placed_2.toml"] and asked[0][1:] == (2, tmp_path)
    assert found["gauges"][1] == {"name": "g2", "angle_deg": 20.0, "y_mm": 3.0, "direction_deg": 90.0}
    code, out, _ = papilla(study_file(), "--place", "2", "--out", tmp_path)
    assert code == 0 and "two gauges leave 0.2" in out and "written: placed_2.toml" in out and "-7.5" in out


@pytest.mark.parametrize("workers, allowed", [(1, True), (8, True), (9, False)])
def test_at_most_four_workers_a_core(papilla, study_file, monkeypatch, workers, allowed):
    asked = []
    price = running.Price(12, 3, 17, 0.25, 0.5, True)
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    monkeypatch.setattr(running, "price", lambda study, say: asked.append(study.name) or price)
    code, out, said = papilla(study_file(), "--explain", "--workers", workers)
    if not allowed:
        assert code == 2 and "--workers must be from 1 to 8, got 9" in said
        return
    assert code == 0 and asked == ["made up"]
    assert out.splitlines() == [
        "12 designs of 3 geometries, gauges at 17 places", "a geometry: from the cache; a design: 250 ms",
        f"about {(2 * 0.5 + 12 * 0.25) / workers:.0f} s with {workers} workers, and 0 calibrations at the end",
    ]  # fmt: skip
    assert "the other geometries may not be in the cache: half a minute each on an idle core" in said


def test_a_price_says_what_is_not_in_the_cache(papilla, study_file, monkeypatch):
    optimised = study_file(("designs = 12", 'kind = "optimise"\ndesigns = 48'))
    prices = iter([running.Price(48, 1, 17, 0.25, 20.0, False), running.Price(48, 1, 17, 0.25, 0.5, True)] * 2)
    monkeypatch.setattr(running, "price", lambda study, say: next(prices))
    code, out, said = papilla(optimised, "--explain", "--workers", 1)
    assert code == 0 and out.startswith("at most 48 designs of 1 geometries") and "a geometry: 20 s;" in out
    assert "not be in the cache" not in said
    _, out, said = papilla(optimised, "--explain")
    assert "not be in the cache" not in said and "from the cache" in out and f"with {PROCESSES} workers" in out
    _, out, _ = papilla(optimised, "--explain", "--json", "--workers", 2)
    found = json.loads(out)
    assert (found["designs"], found["seconds"], found["workers"]) == (48, 6.0, 2) and found["cached"] is False


def test_the_options_of_a_study_reach_it_and_its_results_the_table(papilla, study_file, monkeypatch, tmp_path):
    asked = []
    best = [
        {
            "design": 3,
            "free": {"a": 0.123456, "b": 2.0},
            "objectives": {"sigma_sd": 0.25, "signal_over_noise": 1234.56},
        },
        {"design": 4, "free": {"a": 0.2, "b": 3.0}, "objectives": {"sigma_sd": 0.5, "signal_over_noise": 10.0}},
    ]
    found = SimpleNamespace(confirmed=[SimpleNamespace(sentence="as predicted")], written={"page": ["p.html"]})
    result = {"best": best, "designs": 12}
    monkeypatch.setattr("papilla.design.job.run_study", lambda study, out, **how: asked.append((out, how)) or found)
    monkeypatch.setattr("papilla.design.results.summary", lambda outcome: result)
    monkeypatch.setattr("papilla.design.results.first_words", lambda outcome: ["first words"])
    path = study_file()
    path.chmod(0o444)
    code, out, _ = papilla(path, "--out", tmp_path / "o", "--resume", "--workers", 1)
    path.chmod(0o644)
    folder, how = asked[0]
    assert (
        code == 0 and folder == tmp_path / "o" and (how["resume"], how["workers"], how["scheduler"]) == (True, 1, None)
    )
    first, second, *_ = out.splitlines()
    rows = [" ".join(line.replace("│", " ").split()) for line in out.splitlines()]
    assert (first, second) == ("first words", "as predicted")
    assert "finger_1.toml 0.1235 2 0.25 1235" in rows and "finger_2.toml 0.2 3 0.5 10" in rows
    assert rows[-1].startswith("12 designs in ") and rows[-1].endswith(" s: p.html")
    result["best"] = []
    _, out, _ = papilla(study_file(), "--scheduler", "tcp://host:1", "--insecure")
    assert out.count("\n") == 3 and str(asked[1][0]) == "study"
    assert (asked[1][1]["resume"], asked[1][1]["workers"], asked[1][1]["scheduler"]) == (
        False,
        PROCESSES,
        Scheduler("tcp://host:1", insecure=True),
    )
    code, _, said = papilla(study_file(), "--place", 0)
    assert code == 2 and "--place must be from 1 to 8, got 0" in said
