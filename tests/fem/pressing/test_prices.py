"""Prices of a finger: what they say between measured forces, files, the cache, and who is asked first."""

import dataclasses
import json

import pytest
from pydantic import ValidationError

from papilla.core import cache
from papilla.fem import press
from papilla.fem.pressing.prices import (
    PRICED_QUANTITIES,
    PRICES_FORMAT,
    SHIPPED_PRICES,
    Cost,
    Loss,
    Prices,
    keep,
    known_prices,
)
from papilla.fem.pressing.pricing import PRICED_FORCES_N, PRICED_SPECIMEN, loss, price
from papilla.model.finger import Finger
from papilla.model.specimen import Block

FORCES = (0.05, 0.2, 0.5)


@pytest.fixture
def prices() -> Prices:
    """Prices of a finger that does not exist."""
    hertz, mesh, strain = (Loss(FORCES, (-e, e / 2, e / 4), (e,) * 3, (0.0, 0.0, -2 * e)) for e in (0.08, 0.01, 0.04))
    costs = {"hertz": Cost(1.0, 1e-5), "contact": Cost(1.0, 1e-3), "finite": Cost(0.0, 8.0)}
    return Prices("a finger", "f" * 64, "m" * 64, 0.7, 0.35, "a block", hertz, mesh, strain, costs)


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    """A cache folder of its own."""
    monkeypatch.setenv(cache.CACHE_VARIABLE, str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_between_measured_forces_the_worse_counts_whatever_its_sign(prices):
    for force, sd, area in ((0.05, 0.08, 0.0), (0.2, 0.08, 0.0), (0.3, 0.04, 0.16), (0.5, 0.04, 0.16)):
        assert prices.hertz.at(force, "sd") == sd and prices.hertz.at(force, "contact_area") == area


def test_kept_prices_are_found_by_finger_and_mesh(prices, empty_cache):
    assert known_prices(prices.finger_sha256, prices.mesh_sha256) is None
    keep(prices)
    assert known_prices(prices.finger_sha256, prices.mesh_sha256) == prices
    assert known_prices(prices.finger_sha256, "0" * 64) is None
    assert known_prices("0" * 64, prices.mesh_sha256) is None
    # A damaged entry is reported and does not count
    keep(prices)
    entry = next((empty_cache / "prices").glob("*.entry"))
    entry.write_bytes(entry.read_bytes()[:200])
    with pytest.warns(RuntimeWarning, match="cache entry .* is damaged"):
        assert known_prices(prices.finger_sha256, prices.mesh_sha256) is None


@pytest.mark.parametrize(
    "change",
    [
        lambda d: d.update(schema="papilla.prices/2"),
        lambda d: d["mesh"].pop("sd"),
        lambda d: d["mesh"].update(sd=[0.1, 0.2, True]),
        lambda d: d["mesh"].update(forces=[0.05, 0.5, 0.2]),
        lambda d: d.update(hertz={key: values[:1] for key, values in d["hertz"].items()}),
        lambda d: d.update(colour="red"),
    ],
)
def test_text_that_is_no_prices(prices, change):
    document = json.loads(prices.to_json())
    change(document)
    with pytest.raises(ValidationError):
        PRICES_FORMAT.validate_json(json.dumps(document))


@pytest.mark.parametrize("error, fidelity", [(0.0, "hertz"), (0.5, "contact")])
def test_auto_adds_to_the_error_of_hertz_what_the_mesh_is_known_to_cost(
    prices, empty_cache, linear_reference, error, fidelity
):
    own = dataclasses.replace(linear_reference, finger_sha256=prices.finger_sha256, mesh_sha256=prices.mesh_sha256)
    keep(dataclasses.replace(prices, mesh=Loss(FORCES, *3 * [(error,) * 3])))
    assert press(own, Block(0.51, 10), force=0.3, tolerance=0.3).fidelity == fidelity


def test_the_shipped_error_of_hertz_is_what_is_measured(reference):
    shipped = PRICES_FORMAT.validate_json(SHIPPED_PRICES.read_bytes())
    again = loss(
        *([press(reference, PRICED_SPECIMEN, force=force, fidelity=rung) for force in PRICED_FORCES_N]
          for rung in ("hertz", "contact"))
    )  # fmt: skip
    assert again.forces == shipped.hertz.forces
    for quantity in PRICED_QUANTITIES:
        assert getattr(again, quantity) == pytest.approx(getattr(shipped.hertz, quantity), abs=1e-4)


@pytest.mark.slow
def test_a_finger_is_priced_on_its_meshes_and_auto_finds_it(empty_cache):
    finger, stages = Finger.default(), []
    found = price(finger, size_mm=2.0, progress=stages.append)
    assert found == known_prices(finger.sha256, found.mesh_sha256)
    assert (found.mesh_size_mm, found.finest_size_mm) == (2.0, 1.0)
    assert found.mesh.forces == found.small_strain.forces == PRICED_FORCES_N
    # No two meshes are alike, and on some of this size no ellipse has the least energy
    assert found.hertz is None or found.hertz.forces == PRICED_FORCES_N
    assert set(found.costs) - {"hertz"} == {"contact", "finite"}
    assert any(stage.startswith("pricing: finite strain, press 4 of 4") for stage in stages)
    assert all(abs(error) < 0.2 for error in (*found.mesh.sd, *found.small_strain.sd))
