"""README's Python examples run as printed, and its commands exist."""

import re
import shlex
import shutil
from pathlib import Path

import pytest
from shorter import shortened

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```python\n(.*?)```", README, re.DOTALL)


@pytest.mark.slow
def test_the_examples_run_as_printed_one_after_the_other(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "__main__"}
    for example in EXAMPLES:
        exec(compile(example, "README.md", "exec"), names)
        assert capsys.readouterr().out.strip()


BLOCKS = "".join(re.findall(r"```\n(.*?)```", README, re.DOTALL))
COMMANDS = [line for line in BLOCKS.splitlines() if line.startswith("papilla ")]
ELSEWHERE = ("papilla bench", "--free", "--relaxation", "--compare", "--explain")
"""Run in tests/cli and tests/design: they cost much, or need an identified finger or the geometries of a study."""


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory):
    """A folder with the files that README's commands read, made by papilla."""
    import numpy as np

    import papilla

    folder = tmp_path_factory.mktemp("laboratory")
    finger = papilla.Finger.default()
    reduced = papilla.fem.prepare(finger)
    grid = [(force, modulus) for modulus in (0.089, 0.51) for force in (0.1, 0.2, 0.4, 0.7, 0.95)]
    presses = [papilla.fem.press(reduced, papilla.Block(modulus, 10), force=force) for force, modulus in grid]
    rng = np.random.default_rng(1)
    rows = [
        [force, modulus, *(press.reading + rng.normal(0, 5, 5)), press.indentation]
        for (force, modulus), press in zip(grid, presses, strict=True)
    ]
    names = "force_N,modulus_MPa,g1,g2,g3,g4,g5,indentation_mm"
    for name in ("presses", "today", "known"):
        np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header=names, comments="")
    time = np.arange(2000) / 1000
    for name, wavelength, speed in (("a", 1.5, 30), ("b", 1.5, 60), ("c", 4, 30), ("d", 4, 60), ("log", 4, 45)):
        waves = 50 * np.sin(2 * np.pi * (speed * time[:, None] - np.arange(5)) / wavelength)
        columns = [time, waves + rng.normal(0, 5, waves.shape), np.full_like(time, speed)]
        header = "t_s,g1,g2,g3,g4,g5,velocity_mm_s"
        np.savetxt(folder / f"{name}.csv", np.column_stack(columns), delimiter=",", header=header, comments="")
    (folder / "their_log.csv").write_text("time (ms),Fz [N],ch1,ch2\n0,0.1,1,2\n1,0.2,2,3\n2,0.2,2,3\n")
    table = papilla.calibration.sweep(reduced, moduli=np.geomspace(0.05, 2, 14), forces=np.geomspace(0.05, 1, 16))
    (folder / "calibration").mkdir()
    papilla.calibration.fit(table).save(folder / "calibration" / "calibration.json")
    shutil.copytree(folder / "calibration", folder / "mine")
    finger.save(folder / "finger.toml")
    ramp = np.linspace(0, 1, 200)
    touch = np.column_stack([ramp, ramp[:, None] * presses[2].reading, 0.4 * ramp])
    np.savetxt(folder / "touch.csv", touch, delimiter=",", header="t_s,g1,g2,g3,g4,g5,force_N", comments="")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    "line",
    [line for line in COMMANDS if not any(one in line for one in ELSEWHERE)],
    ids=lambda line: " ".join(shlex.split(line, comments=True)[1:4]),
)
def test_a_command_runs(line, laboratory, tmp_path, monkeypatch, capsys):
    from papilla.cli.main import run

    here = shutil.copytree(laboratory, tmp_path / "laboratory")
    monkeypatch.chdir(here)
    if line.startswith("papilla new"):
        (here / "finger.toml").unlink()
    with pytest.raises(SystemExit) as end:
        run(shortened(line))
    assert end.value.code in (0, "--check" in line), capsys.readouterr().err


def test_the_commands_exist():
    from papilla.cli.main import app

    known = {command.callback.__name__.replace("_", "-") for command in app.registered_commands}
    known |= {group.name for group in app.registered_groups}
    named = set(re.findall(r"^papilla ([\w-]+)", BLOCKS, re.MULTILINE))
    assert named and named <= known
