"""Pricing a finger: the shipped figures measured again, and a whole pricing on coarse meshes."""

import pytest

from papilla import cache
from papilla.fem import press, press_finite
from papilla.fem.pressing import pricing
from papilla.fem.pressing.prices import FORMAT, QUANTITIES, SHIPPED, Prices, known_prices
from papilla.fem.pressing.pricing import FORCES, SPECIMEN, loss, price
from papilla.finger import Finger
from papilla.mesh import build


@pytest.fixture(scope="module")
def shipped() -> Prices:
    """What ships with the package."""
    return FORMAT.validate_json(SHIPPED.read_bytes())


@pytest.fixture(scope="module")
def presses(reference):
    """Presses of the default finger on its reference mesh, on a linear rung."""
    return lambda rung: [press(reference, SPECIMEN, force=force, fidelity=rung) for force in FORCES]


def test_the_shipped_error_of_hertz_is_what_is_measured(shipped, presses):
    again = loss(presses("hertz"), presses("contact"))
    assert again.forces == shipped.hertz.forces
    for quantity in QUANTITIES:
        assert getattr(again, quantity) == pytest.approx(getattr(shipped.hertz, quantity), abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 3])
def test_the_shipped_cost_of_small_strain_is_what_is_measured(shipped, presses, number):
    finite = press_finite(Finger.default(), build(Finger.default()), SPECIMEN, force=FORCES[number])
    cheaper = presses("contact")[number]
    for quantity in QUANTITIES:
        error = getattr(cheaper, quantity) / getattr(finite, quantity) - 1
        assert error == pytest.approx(getattr(shipped.small_strain, quantity)[number], abs=1e-4)


@pytest.mark.slow
def test_the_shipped_mesh_error_is_of_the_size_that_is_measured(shipped, presses, finest):
    """The mesh of half the size is not shipped, and no two are alike: another one gives S_d within half a percent."""
    fine = finest(shipped.finest_size_mm)
    again = loss(presses("contact"), [press(fine, SPECIMEN, force=force, fidelity="contact") for force in FORCES])
    assert again.sd == pytest.approx(shipped.mesh.sd, abs=0.005)
    assert again.indentation == pytest.approx(shipped.mesh.indentation, abs=0.003)


@pytest.mark.slow
def test_a_finger_is_priced_on_its_meshes_and_auto_finds_it(tmp_path, monkeypatch):
    monkeypatch.setenv(cache.ENVIRONMENT, str(tmp_path))
    monkeypatch.setattr(pricing, "FORCES", FORCES[2:])
    finger, stages = Finger.default(), []
    found = price(finger, size_mm=2.0, progress=stages.append)
    assert found == known_prices(finger.sha256, found.mesh_sha256)
    assert (found.mesh_size_mm, found.finest_size_mm) == (2.0, 1.0)
    assert found.mesh.forces == found.small_strain.forces == FORCES[2:]
    # No two meshes are alike, and on some of this size no ellipse has the least energy
    assert found.hertz is None or found.hertz.forces == FORCES[2:]
    assert set(found.costs) - {"hertz"} == {"contact", "finite"}
    assert ("hertz" in found.costs) == (found.hertz is not None)
    assert all(cost.seconds_per_scene > 0 for cost in found.costs.values())
    assert any(stage.startswith("pricing: finite strain, press 2 of 2") for stage in stages)
    assert all(abs(error) < 0.2 for error in (*found.mesh.sd, *found.small_strain.sd))
