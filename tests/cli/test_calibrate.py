"""`papilla calibrate`: files and JSON of the main job, the way from a bench log, and what is refused."""

import json
import subprocess
import sys

import numpy as np
import pytest
from spring_calibration import calibration

from papilla.calibration import DEFAULT_FORCES, DEFAULT_MODULI, Calibration
from papilla.calibration.fitting import job
from papilla.calibration.fitting.fit import with_compact
from papilla.cli.calibrate import SweepOptions
from papilla.core.tables import write_table
from papilla.logs import read_presses
from papilla.mesh import DEFAULT_SIZE_MM
from papilla.model.finger import DEFAULT_FINGER, Finger


@pytest.mark.slow
def test_main_job_writes_what_its_json_names(papilla, tmp_path):
    answer = papilla("calibrate", "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    assert answer.out.count("\n") == 1, "one object and nothing else"
    assert found["max_error"] <= 0.02 and found["rms_error"] <= found["max_error"]
    assert found["checked_presses"] == 100 and found["unanswered"] == 0
    assert found["physics"] == "block 10 mm thick, friction stick, large strain included"
    assert found["dominant"] == "friction" and found["truth"]["inside_interval"] == 1.0
    assert found["truth"]["presses"] == 8 and found["truth"]["sd_max_error"]["stick"] < 0.006
    document = json.loads((tmp_path / found["calibration"]).read_text())
    assert document["schema"] == "papilla.calibration/1"
    for part in ("forward", "inverse"):
        assert found["softness"][part]["coefficients"] == document["softness"][part]["coefficients"]
    presses = read_presses(tmp_path / found["sweep"])
    assert len(presses) == found["presses"]
    assert np.unique(presses.modulus_MPa).size >= 12 and np.unique(presses.force_N).size >= 20
    again = papilla("calibrate", "--out", "again")
    assert (tmp_path / "again" / "sweep.csv").read_bytes() == (tmp_path / "calibration" / "sweep.csv").read_bytes()
    for text in (
        "error of E, max",
        "µε/gf²",
        "Inverse: E = ",
        "dominant: friction (one sigma of S_d: ",
        "Wrote again/",
    ):
        assert text in again.out


def test_help_shows_how_a_finger_from_surface_files_is_written(papilla):
    from papilla.model.file import SHAPE_FORMS

    told = " ".join(papilla("calibrate", "--help").out.split())
    assert f'"shape" of a design names three closed surface files beside it, as papilla/data/{SCANNED} does' in told
    assert f'kind = "surfaces", {SHAPE_FORMS["surfaces"]}' in told and (DEFAULT_FINGER.parent / SCANNED).exists()
    shown = " ".join(told.replace("│", " ").split())
    assert f"[default: {DEFAULT_SIZE_MM:g} for the default finger, in proportion for others]" in shown


@pytest.mark.parametrize("quick", [False, True])
def test_options_of_a_sweep_are_even_ranges_or_what_is_listed(quick):
    def swept(**stated):
        names = ("thickness", "force_range", "moduli")
        return SweepOptions(**({"specimen": "block", "quick": quick} | dict.fromkeys(names) | stated))

    counts = (job.QUICK_FORCES, job.QUICK_MODULI) if quick else (len(DEFAULT_FORCES), len(DEFAULT_MODULI))
    ends = {"forces": (DEFAULT_FORCES[0], DEFAULT_FORCES[-1]), "moduli": (0.1, 1.0)}
    design = Finger.default()
    table = swept(moduli="1,0.1").table(design)
    assert table["quick"] == quick and ("forces" in table) == quick, "what is usual is left to the library"
    for (name, (low, high)), count in zip(ends.items(), counts, strict=True):
        if name in table:
            np.testing.assert_allclose(table[name], low * (high / low) ** (np.arange(count) / (count - 1)))
    assert swept(moduli="0.3,0.1,0.2").table(design)["moduli"] == (0.1, 0.2, 0.3)
    assert swept(force_range=(0.1, 0.4)).table(design)["forces"][:: counts[0] - 1] == pytest.approx((0.1, 0.4))
    assert swept().bench_of(design) == design and swept(thickness=8.0).bench_of(design).bench.thickness == 8
    assert swept(specimen="half-space").bench_of(design).bench.thickness == np.inf


SCANNED = "surfaces_finger.toml"


QUICK = (
    *("--quick", "--moduli", "0.05,1", "--force-range", 0.05, 0.6),
    *("--size-mm", 2.8, "--friction", 0, "--thickness", 8),
)


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    """A folder with what a quick calibration on a coarse mesh writes, and its JSON."""
    folder = tmp_path_factory.mktemp("quick")
    command = [sys.executable, "-m", "papilla", "calibrate", *map(str, QUICK), "--export-c", "f.h", "--json"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder, json.loads(done.stdout)


def presses_of(folder):
    """The presses of a sweep that the model answered; a coarse mesh has none for the largest contacts."""
    lines = (folder / "calibration" / "sweep.csv").read_text().splitlines()
    (folder / "answered.csv").write_text(
        "\n".join(line for line in lines if ",nan" not in line and ",," not in line) + "\n"
    )
    return read_presses(folder / "answered.csv")


@pytest.mark.slow
def test_the_options_of_a_calibration_reach_its_presses_and_files(quick):
    folder, found = quick
    assert {path.name for path in (folder / "calibration").iterdir()} == {
        "calibration.json",
        "sweep.csv",
        "report.html",
    }
    sweep = presses_of(folder)
    assert found["physics"] == "block 8 mm thick, friction 0.0, large strain included"
    assert (sweep.modulus_MPa.min(), sweep.modulus_MPa.max()) == pytest.approx((0.05, 1.0))
    assert sweep.force_N.min() == pytest.approx(0.05) and sweep.force_N.max() == pytest.approx(0.6)
    steps = [np.diff(np.log(np.unique(column))) for column in (sweep.force_N, sweep.modulus_MPa)]
    assert all(np.ptp(one) < 1e-6 for one in steps), "even in the logarithm"
    assert (found["bench"], found["truth"], found["check"]) == (None, None, None) and job.QUICK_NOTE in found["notes"]
    assert found["rms_error"] <= found["max_error"] < 0.1 and found["export_c"] == "f.h"
    assert "papilla_modulus_MPa" in (folder / "f.h").read_text()
    made = Calibration.load(folder / found["calibration"])
    assert made.domain["modulus_MPa"] == pytest.approx((0.05, 1.0)) and made.provenance["physics"] == found["physics"]
    assert found["softness"]["forward"]["coefficients"] == pytest.approx(list(made.forward.coefficients))
    # The gauges of the sweep lead back to its moduli
    inner = (sweep.modulus_MPa > 0.1) & (sweep.modulus_MPa < 0.6) & (sweep.force_N > 0.1)
    back = made.invert(sweep.readings.std(axis=1)[inner], sweep.force_N[inner]).modulus_MPa
    answered = np.isfinite(back)
    assert answered.mean() > 0.5
    assert np.median(np.abs(back / sweep.modulus_MPa[inner] - 1)[answered]) < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("factor, least, most", [(1.0, 0.0, 0.25), (5.0, 0.6, 1.0)])
def test_a_check_passes_what_it_recovers_and_names_what_it_misses(papilla, quick, tmp_path, factor, least, most):
    sweep = presses_of(quick[0])
    some = np.flatnonzero((sweep.modulus_MPa > 0.1) & (sweep.modulus_MPa < 0.6) & (sweep.force_N > 0.2))[::9]
    gauges = {f"g{k + 1}": column[some] for k, column in enumerate(sweep.readings.T)}
    write_table(
        tmp_path / "[c].csv",
        {"force_N": sweep.force_N[some], "modulus_MPa": factor * sweep.modulus_MPa[some], **gauges},
    )
    answer = papilla("calibrate", *QUICK, "--check", "[c].csv")
    missed = answer.out.count("MISSED")
    assert answer.code == (missed > 0) and "check: [c].csv" in answer.out
    assert least <= missed / len(some) <= most
    found = json.loads(papilla("calibrate", *QUICK, "--check", "[c].csv", "--json").out)["check"]
    assert (found["presses"], found["passed"]) == (len(some), not missed)


def test_a_stored_calibration_is_exported_as_c(papilla, refused, tmp_path):
    with_compact(calibration()).save(tmp_path / "c.json")
    (tmp_path / "c.json").chmod(0o444)
    assert papilla("export-c", "c.json", "--out", "f.h", "--real", "float").code == 0
    text = (tmp_path / "f.h").read_text()
    assert "typedef float papilla_real;" in text and "papilla_softness" in text
    assert "would overwrite the input" in refused("export-c", "c.json", "--out", "c.json")
    assert "cannot read" in refused("export-c", "d.json", "--out", "g.h")
