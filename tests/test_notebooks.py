"""Every notebook runs from top to bottom in a fresh kernel, and is kept with small pictures."""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

FOLDER = Path(__file__).parents[1] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
SECONDS_A_CELL = 600
LARGEST_PICTURE = 200_000
"""Bytes of a stored picture."""


def code_cells(notebook) -> list:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def pictures(notebook) -> list[str]:
    """Pictures (base64) that a notebook shows."""
    shown = [output.get("data", {}) for cell in code_cells(notebook) for output in cell.outputs]
    return [data["image/png"] for data in shown if "image/png" in data]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_with_small_pictures_and_pins_its_numbers(path):
    notebook = nbformat.read(path, as_version=4)
    assert all(cell.execution_count for cell in code_cells(notebook)), "a cell was not run"
    assert len(pictures(notebook)) >= 2
    assert all(3 * len(picture) / 4 < LARGEST_PICTURE for picture in pictures(notebook))
    assert sum("assert " in cell.source for cell in code_cells(notebook)) >= 2
    assert "what to try" in notebook.cells[-1].source.lower()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning:jupyter_client", "ignore::DeprecationWarning:zmq")
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_shows_its_pictures(path, tmp_path):
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(notebook, timeout=SECONDS_A_CELL, resources={"metadata": {"path": str(tmp_path)}})
    client.execute()
    shown = [output for cell in code_cells(notebook) for output in cell.outputs]
    assert len(pictures(notebook)) >= 2
    written = [output.text for output in shown if output.get("name") == "stderr"]
    # Another test may be making what a notebook needs from the cache
    assert not [text for text in written if "waiting for another process that makes" not in text], written
    assert not list(tmp_path.iterdir()), "the notebook left files behind"
