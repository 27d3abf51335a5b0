"""The defaults of all options, pinned: they are part of what a command line means."""

import pytest
import typer

from papilla.cli import output
from papilla.cli.main import app
from papilla.cli.options import PROCESSES

DEFAULTS = {
    "calibrate": {"--specimen": "block", "--out": "calibration", "--quick": False},
    "identify": {"--specimen": "block", "--criterion": "I", "--noise": 5.0, "--force-error": 0.01},
    "new": {"--shape": "dome"},
    "compare": {},
    "press": {"--specimen": "block", "--at": (0.0, 0.0), "--fidelity": "auto"},
    "slide": {
        "--form": "trapezoid", "--flank": 0.0, "--rate": 1000.0, "--dynamics": "auto", "--noise-microstrain": 0.0,
        "--seed": 0, "--ridges": True,
    },
    "estimate": {"--softness": "gauges"},
    "view": {"--specimen": "block", "what": "strain", "--at": (0.0, 0.0)},
    "export-c": {"--real": "double"},
    "design": {"--out": "study", "--resume": False, "--explain": False, "--insecure": False},
    "doctor": {"--clean": False},
    "verify": {},
    "bench": {"--short": False},
    "reproduce": {"--only": ""},
    "figures": {"--paper": "", "--out": "figures"},
    "log map": {},
    "texture train": {"--window": 100.0, "--wavelengths": (1.0, 50.0), "--bands": 8},
    "texture classify": {},
    "telepresence simulate": {
        "--wavelength": 1.2, "--amplitude": 50.0, "--noise": 3.5, "--round-trip-ms": 120.0, "--round-trip-sd-ms": 40.0,
        "--uplink-share": 0.0, "--jitter-ms": 0.0, "--loss": 0.0, "--reordering": 0.0, "--duplication": 0.0,
        "--speed": 197.0, "--strokes": 1.07, "--force": 0.5, "--components": 1, "--actuator": "piezo",
        "--rule": "measured", "--seconds": 8.0, "--parameters-rate": 50.0, "--seed": 0,
    },
    "telepresence sensor": {
        "--listen": "127.0.0.1:47001", "--peer": "127.0.0.1:47002", "--wavelength": 1.2, "--amplitude": 50.0,
        "--noise": 3.5, "--components": 1, "--parameters-rate": 50.0, "--seed": 0,
    },
    "telepresence display": {
        "--listen": "127.0.0.1:47002", "--peer": "127.0.0.1:47001", "--speed": 197.0, "--strokes": 1.07, "--force": 0.5,
        "--components": 1, "--actuator": "piezo", "--rule": "measured",
    },
}  # fmt: skip


def commands(group, name: str = ""):
    """Each command with its whole name."""
    for own, command in getattr(group, "commands", {}).items():
        yield from commands(command, f"{name} {own}".strip())
    if not hasattr(group, "commands"):
        yield name, {option.opts[-1]: option for option in group.params}


FOUND = dict(commands(typer.main.get_command(app)))


def test_all_commands_are_here():
    assert list(FOUND) == list(DEFAULTS)


@pytest.mark.parametrize("name", DEFAULTS)
def test_defaults(name):
    found = {key: option.default for key, option in FOUND[name].items() if not option.required}
    stated = {key: value for key, value in found.items() if value is not None}
    stated = {key: value if isinstance(value, int | float | tuple) else str(value) for key, value in stated.items()}
    assert {key: value for key, value in stated.items() if key not in ("--json", "--help")} == DEFAULTS[name]
    assert found.get("--json", False) is False


@pytest.mark.parametrize("name", ["simulate", "sensor"])
@pytest.mark.parametrize(
    "option, value, said",
    [
        ("--seed", -1, "greater than or equal to 0"),
        ("--components", 0, "greater than or equal to 1"),
        ("--components", 9, "less than or equal to 8"),
    ],
)
def test_numbers_out_of_range_are_refused(refused, name, option, value, said):
    assert said in refused("telepresence", name, option, value)


def test_codes_and_processes():
    codes = (output.CHECK_FAILED, output.BAD_INPUT, output.INTERNAL, output.INTERRUPTED, output.BROKEN_PIPE)
    assert codes == (1, 2, 70, 130, 141) and output.TERMINATED == 143 and PROCESSES in (1, 2)
