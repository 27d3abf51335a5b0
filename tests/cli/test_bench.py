"""`papilla bench`: the short form as JSON and plot, and what is refused."""

import json

import pytest

ROW_KEYS = {
    *("fidelity", "element", "size_mm", "dofs", "seconds_setup", "seconds_per_scene"),
    *("error_sd", "error_indentation", "error_area", "peak_memory_MiB", "factor_nonzeros"),
}


@pytest.mark.slow
def test_short_form(papilla, tmp_path):
    answer = papilla("bench", "--short", "--json", "--out", tmp_path / "priced")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    assert answer.out.count("\n") == 1, "one object and nothing else"
    rows = {(row["fidelity"], row["element"], row["size_mm"]): row for row in found["rows"]}
    assert len(rows) == len(found["rows"]) == 12
    for row in found["rows"]:
        assert set(row) >= ROW_KEYS
        assert row["seconds_setup"] >= 0 and row["peak_memory_MiB"] > 50
        if row["fidelity"] == "hertz" and row["size_mm"] > 1 and row["status"].startswith("refused"):
            assert row["seconds_per_scene"] is None, "no ellipse has the least energy on some meshes this coarse"
            continue
        assert row["status"] == "answered"
        assert 0 <= row["error_sd"] < 1 and row["seconds_per_scene"] > 0
    by_element = {element: rows["contact", element, 2.8] for element in ("Taylor-Hood", "P2", "P1")}
    assert by_element["P1"]["error_sd"] > 0.9, "P1 locks"
    # Meshes this coarse scatter by as much as they differ: no order is asserted between them, only between elements.
    assert max(rows["contact", "Taylor-Hood", size]["error_sd"] for size in (2.0, 2.8)) < 0.2
    assert rows["contact", "Taylor-Hood", 0.7]["reference"] and rows["contact", "Taylor-Hood", 0.7]["error_sd"] == 0
    assert rows["hertz", "Taylor-Hood", 0.7]["error_sd"] < 0.03
    # A contact one element wide: 0.055 on the mesh that ships
    assert 0.01 < rows["finite", "Taylor-Hood", 2.8]["small_strain_sd"] < 0.06
    assert any(row["pareto"] for row in found["rows"])
    assert found["plot"] == str(tmp_path / "priced" / "speed_against_error.png")
    assert (tmp_path / "priced" / "speed_against_error.png").read_bytes().startswith(b"\x89PNG")
    assert "fidelity finite on 2.8 mm" in answer.err


def test_bad_input_is_refused_before_anything_is_measured(refused, tmp_path):
    (tmp_path / "file").write_text("")
    assert "cannot write to folder" in refused("bench", "--short", "--out", tmp_path / "file")
    assert "missing.toml" in refused("bench", "--short", "--finger", tmp_path / "missing.toml", "--out", tmp_path)
