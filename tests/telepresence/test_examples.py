"""The examples: what the bridge shows of a message, and ends of one's own that find each other."""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import pytest
from free_ports import free_ports

from papilla.telepresence import Address, Component, QuantityTrust
from papilla.telepresence.messages import (
    Area,
    HandReading,
    Header,
    Length,
    Modulus,
    Parameters,
    encode,
    lines_of,
    quantity,
)

EXAMPLES = Path(__file__).parents[2] / "examples"
HEADER = Header(1, 5, 7, 10, 0, 0, 0)


def example(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def bridge():
    return example("zenoh_bridge")


def test_parameters_are_shown_with_units_sigma_and_status(bridge):
    lines = lines_of((Component(1.2, 40.0, 0.01, 0.3),))
    modulus, area = quantity(Modulus, 0.3, 0.02, QuantityTrust.DOUBTED), quantity(Area, float("nan"))
    told = bridge.plain(encode(Parameters(HEADER, int(QuantityTrust.OK), lines, modulus, area=area)))
    assert json.loads(json.dumps(told)) == told and told["sequence"] == 7 and told["texture"] == "ok"
    assert told["lines"][0]["wavelength_mm"] == {"value": 1.2, "sigma": 0.01, "status": "ok"}
    assert told["modulus_MPa"] == {"value": 0.3, "sigma": 0.02, "status": "doubted"}
    assert told["contact_area_mm2"] == {"value": None, "sigma": None, "status": "unknown"}
    assert "mu_kinetic" not in told


def test_nothing_else_is_shown(bridge):
    assert bridge.plain(encode(HandReading(HEADER, quantity(Length, 1.0)))) is None
    for datagram in (b"", b"\x91" * 900, b"0123456789abcdef" + encode(HandReading(HEADER, quantity(Length, 1.0)))):
        assert bridge.plain(datagram) is None


def test_without_the_library_one_line_says_so():
    code = (
        f"import runpy, sys; sys.modules['zenoh'] = None; e = runpy.run_path({str(EXAMPLES / 'zenoh_bridge.py')!r}); "
    )
    code += "sys.exit(e['main'](['sensor']))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr == "zenoh_bridge: the package eclipse-zenoh is missing: pip install eclipse-zenoh\n"


class FeltError(Exception):
    """The actuator is driven."""


def test_ends_of_ones_own_find_each_other():
    here, there = (Address("127.0.0.1", port) for port in free_ports(2))
    run = f"import runpy; e = runpy.run_path({str(EXAMPLES / 'own_ends.py')!r}); A = e['Address']; "
    run += f"e['sensor'](120.0, A(*{tuple(here)}), A(*{tuple(there)}))"

    def feel(volts):
        assert 0 <= volts <= 150
        if abs(volts - 75) > 20:
            raise FeltError

    sensor = subprocess.Popen([sys.executable, "-c", run])
    try:
        with pytest.raises(FeltError):
            example("own_ends").display(60.0, there, here, feel)
    finally:
        sensor.kill()
        sensor.wait()
