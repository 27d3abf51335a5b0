"""Pricing a finger: the shipped figures measured again, and a whole pricing on coarse meshes."""

from types import SimpleNamespace

import numpy as np
import pytest

from papilla.core import cache
from papilla.core.errors import ContactRangeError
from papilla.fem import prepare, press, press_finite
from papilla.fem.pressing import pricing
from papilla.fem.pressing.prices import FORMAT, QUANTITIES, SHIPPED, Cost, Prices, known_prices
from papilla.fem.pressing.pricing import FORCES, SPECIMEN, loss, price
from papilla.mesh import build
from papilla.model.finger import Finger


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


@pytest.fixture
def stated(monkeypatch):
    """Presses that are stated, not computed: each mesh and each fidelity has an S_d of its own, in percent."""
    sds = {("coarse", "hertz"): 103.0, ("coarse", "contact"): 102.0, ("fine", "contact"): 100.0, "finite": 101.0}
    asked = []

    def pressed(sd, force, seconds):
        return SimpleNamespace(sd=sd, indentation=2 * force, contact_area=10.0, force=force, seconds=seconds)

    def linear(reduced, specimen, *, force, fidelity):
        asked.append((reduced.name, fidelity, force))
        assert specimen is SPECIMEN
        if sds[reduced.name, fidelity] is None:
            raise ContactRangeError("no ellipse")
        return pressed(sds[reduced.name, fidelity], force, 1e-3 * force)

    coarse, fine = (SimpleNamespace(name=name, mesh_size_mm=size) for name, size in (("coarse", 1.4), ("fine", 0.7)))
    mesh = SimpleNamespace(sha256="m" * 64, mesh_size_mm=1.4, size_mm=1.4)
    monkeypatch.setattr(pricing, "build", lambda finger, size_mm, progress: asked.append(size_mm) or mesh)
    monkeypatch.setattr(pricing, "FingerModel", lambda *_: SimpleNamespace(reduce=lambda: coarse))
    monkeypatch.setattr(pricing, "prepare", lambda finger, size_mm, progress: asked.append(size_mm) or fine)
    monkeypatch.setattr(pricing, "press", linear)
    monkeypatch.setattr(pricing, "press_finite", lambda finger, on, specimen, force: pressed(sds["finite"], force, 8.0))
    return sds, asked


def test_each_fidelity_is_measured_against_the_next_better_one(stated):
    _, asked = stated
    finger, said = Finger.default(), []
    found = pricing.measure_prices(finger, size_mm=1.4, progress=said.append)
    assert [one for one in asked if isinstance(one, float)] == [1.4, 0.7]
    assert (found.finger_name, found.finger_sha256, found.mesh_sha256) == (finger.name, finger.sha256, "m" * 64)
    assert (found.mesh_size_mm, found.finest_size_mm) == (1.4, 0.7) and found.specimen == "a 10 mm block of 0.51 MPa"
    for measured, error in ((found.hertz, 103 / 102), (found.mesh, 102 / 100), (found.small_strain, 102 / 101)):
        assert measured.forces == FORCES == pytest.approx([0.0490, 0.1961, 0.4903, 0.9807], rel=1e-3)
        assert (
            measured.sd == pytest.approx([error - 1] * 4) and measured.indentation == measured.contact_area == (0,) * 4
        )
    # Forty presses at forces in equal ratios: the median is the force in the middle, here times a thousandth
    middle = 1e-3 * np.median(np.geomspace(FORCES[0], FORCES[-1], 40))
    assert found.costs["finite"] == Cost(0.0, 8.0) and set(found.costs) == {"hertz", "contact", "finite"}
    for name in ("hertz", "contact"):
        assert found.costs[name].seconds_per_scene == pytest.approx(middle) and found.costs[name].seconds_setup < 1
        assert sum(one[:2] == ("coarse", name) for one in asked if isinstance(one, tuple)) == 4 + 40
    assert said[0] == "pricing: assembling and reducing" and said[-1] == "pricing: finite strain, press 4 of 4"


def test_where_hertz_has_no_answer_its_error_and_cost_are_left_out(stated):
    stated[0]["coarse", "hertz"] = None
    found = pricing.measure_prices(Finger.default())
    assert found.hertz is None and set(found.costs) == {"contact", "finite"} and stated[1][:1] == [0.7]


def test_prices_that_ship_are_rounded_to_a_hundredth_of_a_percent(stated, tmp_path, monkeypatch):
    monkeypatch.setattr(pricing, "SHIPPED", tmp_path / "prices.json")
    pricing.ship()
    found = FORMAT.validate_json((tmp_path / "prices.json").read_bytes())
    assert found.hertz.sd == (0.0098,) * 4 and found.mesh.sd == (0.02,) * 4 and found.small_strain.sd == (0.0099,) * 4


def test_measured_prices_are_kept(stated, tmp_path, monkeypatch):
    monkeypatch.setenv(cache.ENVIRONMENT, str(tmp_path))
    found = price(Finger.default(), size_mm=1.4)
    assert known_prices(found.finger_sha256, found.mesh_sha256) == found


@pytest.mark.slow
@pytest.mark.parametrize("number", [3])
def test_the_shipped_cost_of_small_strain_is_what_is_measured(shipped, presses, number):
    finite = press_finite(Finger.default(), build(Finger.default()), SPECIMEN, force=FORCES[number])
    cheaper = presses("contact")[number]
    for quantity in QUANTITIES:
        error = getattr(cheaper, quantity) / getattr(finite, quantity) - 1
        assert error == pytest.approx(getattr(shipped.small_strain, quantity)[number], abs=1e-4)


@pytest.mark.slow
def test_the_shipped_mesh_error_is_of_the_size_that_is_measured(shipped, presses):
    """Against half the size (0.35 mm) 0.24 % of S_d at most; 0.5 mm tells as much in a fifth of the time."""
    fine = prepare(Finger.default(), size_mm=0.5)
    again = loss(presses("contact"), [press(fine, SPECIMEN, force=force, fidelity="contact") for force in FORCES])
    assert again.sd == pytest.approx(shipped.mesh.sd, abs=0.002)
    assert again.indentation == pytest.approx(shipped.mesh.indentation, abs=0.0015)


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
