"""Studies, and runs of them on a made-up geometry."""

from dataclasses import replace

import pytest
from made_up_geometry import made_up_map

from papilla.design import read_study, run_study

STUDY = """
name = "made up"
objectives = ["sigma_sd", "signal_over_noise"]

[free]
"outer.modulus_MPa" = [0.1, 0.6]
"gauges.spread_deg" = { low = 20.0, high = 50.0 }

[couplings]
"inner.modulus_MPa" = "outer.modulus_MPa / 4"

[sampler]
designs = 12
"""

OWN = '"gauges.spread_deg" = { low = 20.0, high = 50.0 }', '"gauges.lever_mm" = [-1.0, 0.0]'
"""Keeps the gauges in their places, for which the change by large strain is known."""


@pytest.fixture
def study_file(tmp_path):
    """Writes a study file, with parts of the text replaced; of the finger's own gauges if asked."""

    def write(*changes: tuple[str, str], own: bool = False):
        text = STUDY
        for old, new in ([OWN] if own else []) + [*changes]:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "study.toml"
        path.write_text(text)
        return path

    return write


@pytest.fixture
def made_up_geometry():
    """`made_up_map`, which makes the geometry of a design at some places."""
    return made_up_map


@pytest.fixture
def made_up(study_file):
    """Reads a study of the finger's own gauges, with parts of its text replaced, on the made-up geometry."""

    def study(*changes: tuple[str, str]):
        return replace(read_study(study_file(*changes, own=True)), geometry=made_up_map)

    return study


@pytest.fixture
def ran(made_up, tmp_path):
    """Runs such a study in this process, without a page."""

    def run(*changes: tuple[str, str], out="out", **how):
        study = how.pop("study", None) or made_up(*changes)
        return run_study(study, tmp_path / out, workers=0, with_page=False, **how)

    return run
