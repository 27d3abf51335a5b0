"""Prices of a finger: what they say between measured forces, files, the cache, and who is asked first."""

import dataclasses
import json

import pytest
from pydantic import ValidationError

from papilla.core import cache
from papilla.fem import press
from papilla.fem.pressing.prices import PRICES_FORMAT, Cost, Loss, Prices, keep, known_prices
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


@pytest.mark.parametrize(
    "force, sd, area", [(0.05, 0.08, 0.0), (0.1, 0.08, 0.0), (0.2, 0.08, 0.0), (0.3, 0.04, 0.16), (0.5, 0.04, 0.16)]
)
def test_between_measured_forces_the_worse_counts_whatever_its_sign(prices, force, sd, area):
    assert prices.hertz.at(force, "sd") == sd and prices.hertz.at(force, "contact_area") == area


def test_kept_prices_are_found_by_finger_and_mesh(prices, empty_cache):
    assert known_prices(prices.finger_sha256, prices.mesh_sha256) is None
    keep(prices)
    assert known_prices(prices.finger_sha256, prices.mesh_sha256) == prices
    assert known_prices(prices.finger_sha256, "0" * 64) is None
    assert known_prices("0" * 64, prices.mesh_sha256) is None


def test_damaged_prices_are_reported_and_do_not_count(prices, empty_cache):
    keep(prices)
    entry = next((empty_cache / "prices").glob("*.entry"))
    entry.write_bytes(entry.read_bytes()[:200])
    with pytest.warns(RuntimeWarning, match="cache entry .* is damaged"):
        assert known_prices(prices.finger_sha256, prices.mesh_sha256) is None


@pytest.mark.parametrize(
    "change",
    [
        lambda d: d.update(schema="papilla.prices/2"),
        lambda d: d.pop("mesh"),
        lambda d: d["mesh"].pop("sd"),
        lambda d: d["mesh"].update(sd=[0.1, 0.2]),
        lambda d: d["mesh"].update(sd=[0.1, 0.2, None]),
        lambda d: d["mesh"].update(sd=[0.1, 0.2, True]),
        lambda d: d["mesh"].update(forces=[0.05, 0.5, 0.2]),
        lambda d: d["mesh"].update(peak=[0, 0, 0]),
        lambda d: d.update(hertz={key: values[:1] for key, values in d["hertz"].items()}),
        lambda d: d["costs"].update(contact={"seconds_setup": 1}),
        lambda d: d.update(finger_name=3),
        lambda d: d.update(colour="red"),
        lambda d: d.update(costs=[]),
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
