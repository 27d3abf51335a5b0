"""`papilla design`: what it refuses at once; slow: a real study, its price and placed gauges."""

import json

import pytest
from command_fixtures import papilla as papilla
from command_fixtures import refused as refused

from papilla.model.finger import Finger


@pytest.mark.parametrize(
    "options, said",
    [
        (["--workers", "0"], "--workers must be from 1"),
        (["--workers", "1", "--scheduler", "tcp://host:1"], "not both"),
        (["--scheduler", "tcp://host:1"], "tcp://host:1 is open: whoever reaches it runs code as you"),
        (["--scheduler", "tls://host:1"], "needs --tls-ca, --tls-cert and --tls-key"),
        (["--scheduler", "tls://host:1", "--insecure"], "give one of them"),
        (["--scheduler", "tcp://host:1", "--insecure", "--tls-ca", "ca.pem"], "need an address that begins with tls"),
        (["--scheduler", "ucx://host:1", "--insecure"], "must be an address that begins with tls://, got ucx://host:1"),
        (["--scheduler", "tcp://host\n:1", "--insecure"], "must be an address such as tls://host:8786"),
        (["--insecure"], "are for --scheduler"),
        (["--place", "9"], "--place must be from 1 to 8"),
    ],
)
def test_bad_options_are_one_line(refused, study_file, options, said):
    assert said in refused("design", study_file(), *options)


def test_a_bad_study_is_one_line(refused, study_file, tmp_path):
    assert "did you mean 'gauges.spread_deg'" in refused("design", study_file(("spread_deg", "spread")))
    assert "absent.toml" in refused("design", tmp_path / "absent.toml")
    fixed = study_file(("[couplings]", '[fixed]\n"gauges.count" = 3\n[couplings]'), own=True)
    assert "--place decides where gauges sit" in refused("design", fixed, "--place", 3)


@pytest.mark.slow
def test_a_study_as_json_and_as_text(papilla, study_file, tmp_path):
    path = study_file(("designs = 12", "designs = 6"), own=True)
    priced = json.loads(papilla("design", path, "--explain", "--json", "--out", "none").out)
    assert (priced["designs"], priced["geometries"]) == (6, 1) and not (tmp_path / "none").exists()
    found = json.loads(papilla("design", path, "--out", "a", "--json", "--workers", 1).out)
    assert found["designs"] == 6 and set(found["best"][0]) >= {"design", "finger", "free", "objectives"}
    again = papilla("design", path, "--out", "a", "--resume", "--workers", 1)
    assert again.code == 0 and "finger_1.toml" in again.out
    page = (tmp_path / "a" / "study.html").read_text()
    assert "Strain field" in page and "finger_1.toml" in page
    assert papilla("design", path, "--out", "a", "--workers", 1).code == 2


@pytest.mark.slow
def test_placed_gauges_are_in_a_table_a_page_and_files(papilla, study_file, tmp_path):
    scene = "[sampler]", "[scene]\nforces = 2\nmoduli = 2\n[sampler]"
    found = json.loads(papilla("design", study_file(scene, own=True), "--place", 3, "--out", "p", "--json").out)
    assert len(found["gauges"]) == 3 and [one["name"] for one in found["gauges"]] == ["g1", "g2", "g3"]
    finger = Finger.load(tmp_path / "p" / "placed_3.toml")
    assert [one.angle_deg for one in finger.gauges] == [one["angle_deg"] for one in found["gauges"]]
    assert all((tmp_path / "p" / f"placement.{kind}").exists() for kind in ("csv", "html"))
    for by_count in found["sigma"].values():
        for sigma in by_count.values():
            assert sigma == sorted(sigma, reverse=True), "a further gauge never tells less"
