"""Type checkers and editors see what the lazy packages offer."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
RIGHT = [
    "finger: papilla.finger.Finger = papilla.Finger.default()",
    "skin: float = papilla.Layer(0.1).modulus + papilla.Ogden(1.0, 2.0).mu",
    "pipeline = papilla.estimators.Pipeline(gauges=2)",
    "picture = papilla.view.strain_figure",
]
WRONG = ["papilla.Fingre", "papilla.Finger.default().outre", "papilla.estimators.Pipline", "papilla.view.stain"]


@pytest.mark.slow
def test_right_code_passes_and_each_misspelt_name_is_an_error(tmp_path):
    snippet = tmp_path / "snippet.py"
    snippet.write_text("\n".join(["import papilla", "import papilla.finger", *RIGHT, *WRONG]))
    options = ["--cache-dir", str(tmp_path), "--config-file", str(ROOT / "pyproject.toml")]
    command = [sys.executable, "-m", "mypy", *options, str(snippet)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    found = [line.split("snippet.py:")[1] for line in done.stdout.splitlines() if "snippet.py:" in line]
    assert [int(line.split(":")[0]) for line in found] == [7, 8, 9, 10], done.stdout
    assert all("has no attribute" in line for line in found)
