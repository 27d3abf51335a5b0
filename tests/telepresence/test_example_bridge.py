"""The example of a bridge: what it shows of a message, and what it says without its library."""

import importlib.util
import json
import sys
from pathlib import Path

import pytest

from papilla.telepresence import Component, Trust
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

SOURCE = Path(__file__).parents[2] / "examples" / "zenoh_bridge.py"
HEADER = Header(1, 5, 7, 10, 0, 0, 0)


@pytest.fixture(scope="module")
def bridge():
    spec = importlib.util.spec_from_file_location("zenoh_bridge", SOURCE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_parameters_are_shown_with_units_sigma_and_status(bridge):
    lines = lines_of((Component(1.2, 40.0, 0.01, 0.3),))
    modulus, area = quantity(Modulus, 0.3, 0.02, Trust.DOUBTED), quantity(Area, float("nan"))
    told = bridge.plain(encode(Parameters(HEADER, int(Trust.OK), lines, modulus, area=area)))
    assert json.loads(json.dumps(told)) == told and told["sequence"] == 7 and told["texture"] == "ok"
    assert told["lines"][0]["wavelength_mm"] == {"value": 1.2, "sigma": 0.01, "status": "ok"}
    assert told["modulus_MPa"] == {"value": 0.3, "sigma": 0.02, "status": "doubted"}
    assert told["contact_area_mm2"] == {"value": None, "sigma": None, "status": "unknown"}
    assert "mu_kinetic" not in told


def test_nothing_else_is_shown(bridge):
    assert bridge.plain(encode(HandReading(HEADER, quantity(Length, 1.0)))) is None
    for datagram in (b"", b"\x91" * 900, b"0123456789abcdef" + encode(HandReading(HEADER, quantity(Length, 1.0)))):
        assert bridge.plain(datagram) is None


def test_without_the_library_one_line_says_so(bridge, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "zenoh", None)
    assert bridge.main(["sensor"]) == 2
    assert capsys.readouterr().err == "zenoh_bridge: the package eclipse-zenoh is missing: pip install eclipse-zenoh\n"
