"""Pricing a finger: the shipped figures measured again, and a whole pricing on coarse meshes."""

import pytest

from papilla.core import cache
from papilla.fem import press
from papilla.fem.pressing.prices import PRICED_QUANTITIES, PRICES_FORMAT, SHIPPED_PRICES, Prices, known_prices
from papilla.fem.pressing.pricing import PRICED_FORCES_N, PRICED_SPECIMEN, loss, price
from papilla.model.finger import Finger


@pytest.fixture(scope="module")
def shipped() -> Prices:
    """What ships with the package."""
    return PRICES_FORMAT.validate_json(SHIPPED_PRICES.read_bytes())


@pytest.fixture(scope="module")
def presses(reference):
    """Presses of the default finger on its reference mesh, on a linear rung."""
    return lambda rung: [press(reference, PRICED_SPECIMEN, force=force, fidelity=rung) for force in PRICED_FORCES_N]


def test_the_shipped_error_of_hertz_is_what_is_measured(shipped, presses):
    again = loss(presses("hertz"), presses("contact"))
    assert again.forces == shipped.hertz.forces
    for quantity in PRICED_QUANTITIES:
        assert getattr(again, quantity) == pytest.approx(getattr(shipped.hertz, quantity), abs=1e-4)


@pytest.mark.slow
def test_a_finger_is_priced_on_its_meshes_and_auto_finds_it(tmp_path, monkeypatch):
    monkeypatch.setenv(cache.CACHE_VARIABLE, str(tmp_path))
    finger, stages = Finger.default(), []
    found = price(finger, size_mm=2.0, progress=stages.append)
    assert found == known_prices(finger.sha256, found.mesh_sha256)
    assert (found.mesh_size_mm, found.finest_size_mm) == (2.0, 1.0)
    assert found.mesh.forces == found.small_strain.forces == PRICED_FORCES_N
    # No two meshes are alike, and on some of this size no ellipse has the least energy
    assert found.hertz is None or found.hertz.forces == PRICED_FORCES_N
    assert set(found.costs) - {"hertz"} == {"contact", "finite"}
    assert ("hertz" in found.costs) == (found.hertz is not None)
    assert all(cost.seconds_per_scene > 0 for cost in found.costs.values())
    assert any(stage.startswith("pricing: finite strain, press 4 of 4") for stage in stages)
    assert all(abs(error) < 0.2 for error in (*found.mesh.sd, *found.small_strain.sd))
