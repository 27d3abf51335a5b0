"""What a press refuses or says where its answer cannot be trusted: balls, strain, thin skins, facets, numbers' ends."""

import dataclasses
import warnings

import numpy as np
import pytest

from papilla.core.errors import ContactRangeError, InputError
from papilla.fem import FingerModel, press
from papilla.fem.pressing import fidelity as choice
from papilla.fem.pressing.contact import contact_press
from papilla.model.finger import Finger
from papilla.model.specimen import Block, HalfSpace, Sphere
from papilla.references import hertz_sphere_at

BLOCK = Block(0.51, 10)


@pytest.fixture(scope="module")
def reference(linear_reference):
    """Here all presses are linear."""
    return linear_reference


@pytest.fixture(scope="module")
def stiff_skin():
    """The default finger on its reference mesh with an outer layer 12.5 times as stiff as the inner one."""
    return _of_moduli(0.538, 0.043)


@pytest.fixture(scope="module")
def soft_skin():
    """The same with a soft skin over a core 100 times harder."""
    return _of_moduli(0.034, 3.4)


def _of_moduli(outer, inner):
    from papilla.mesh import build

    finger = Finger.default()
    layers = {
        name: dataclasses.replace(getattr(finger, name), modulus=E) for name, E in (("outer", outer), ("inner", inner))
    }
    return FingerModel(dataclasses.replace(finger, **layers), build(finger)).reduce()


# ---- Balls


@pytest.mark.parametrize("radius, size", [(0.1, 0.076), (0.2, 0.15), (0.4, 0.3)])
@pytest.mark.parametrize("fidelity", ["auto", "contact"])
def test_a_ball_that_the_patch_cannot_see_is_refused_with_the_size_that_could(reference, radius, size, fidelity):
    message = rf"too coarse for a ball of {radius:g} mm radius: 0.46 mm elements .*; mesh with size_mm <= {size:g} "
    with pytest.raises(ContactRangeError, match=message):
        press(reference, Sphere(0.5, radius), force=0.1, fidelity=fidelity)


# ---- How many elements a contact needs


@pytest.mark.parametrize("rings", [12, 13])
def test_a_resolved_contact_is_right(disc, stand_in, rings):
    """Whatever is called resolved, from 2.5 elements across its radius on, is within 1 % in indentation and 5 % in area
    of Hertz's exact answer; a contact of 2.4 elements is 1.5 and 11 % off."""
    radius, modulus = 20.0, 0.2
    patch = disc(4.0, rings, lambda x, y: (x**2 + y**2) / (2 * radius))
    body, resolved = stand_in(patch, modulus), []
    for a in np.arange(0.3, 2.25, 0.1):
        exact = hertz_sphere_at(a**2 / radius, radius, modulus)
        found = contact_press(body, HalfSpace(1e6), (exact.force, None), 0.0)
        across = np.sqrt(found.contact_area / np.pi) / patch.mean_edge(found.active)
        assert found.resolved == (across >= 2.5) == (not found.status.startswith("mesh too coarse"))
        if found.resolved:
            resolved.append(a)
            assert found.indentation == pytest.approx(exact.indentation, rel=0.0075)
            assert found.contact_area == pytest.approx(exact.area, rel=0.045)
        else:
            size = float(found.status.split("size_mm <= ")[1].split()[0])
            assert size == pytest.approx(body.mesh_size_mm * across / 2.5, rel=0.1), "the size that would resolve it"
    assert len(resolved) >= 11


# ---- Ellipses that have no least energy


# ---- Gauges that cannot differ


@pytest.mark.parametrize("gauges", [[2], [1, 3]], ids=["one", "mirrored"])
def test_auto_serves_gauges_without_a_spread(reference, gauges):
    finger = dataclasses.replace(
        reference,
        rows=reference.rows[:, gauges],
        weights=reference.weights[:, gauges],
        gauge_names=tuple(reference.gauge_names[number] for number in gauges),
    )
    lax = press(finger, BLOCK, force=0.1, tolerance=0.2)
    truth = press(finger, BLOCK, force=0.1, fidelity="contact")
    assert lax.fidelity == "hertz" and lax.sd == pytest.approx(0, abs=1e-9)
    assert lax.reading == pytest.approx(truth.reading, rel=0.2)
    off = choice.probe_hertz(finger, BLOCK)[:, 0]
    assert (off[np.isfinite(off)] > 0).all(), "the readings are compared where their spread cannot be"


# ---- Forces, depths and sizes at the end of the numbers


@pytest.mark.parametrize("values", [{"force": 1e-30}, {"force": 1e300}, {"indentation": 1e-300}, {"indentation": 1e30}])
@pytest.mark.parametrize("fidelity", ["auto", "hertz", "contact"])
def test_loads_beyond_reason_are_refused(reference, values, fidelity):
    with pytest.raises(InputError, match=r"(force \(N\)|indentation \(mm\)) must lie between .* and .*, got "):
        press(reference, BLOCK, fidelity=fidelity, **values)


@pytest.mark.slow
def test_a_whole_range_of_scenes_is_answered_or_refused_without_a_warning(reference, stiff_skin, soft_skin):
    """Without friction: eleven decades of modulus, 13 of force, three specimens: finite numbers of the right sign, or a
    refusal."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for finger in (reference, stiff_skin, soft_skin):
            for modulus in np.geomspace(1e-5, 1e6, 5):
                for specimen in (Block(modulus, 10), Sphere(modulus, 5), HalfSpace(modulus)):
                    for force in np.geomspace(1e-10, 1e3, 9):
                        for fidelity in ("auto", "hertz"):
                            try:
                                found = press(finger, specimen, force=force, fidelity=fidelity, friction=0)
                            except ContactRangeError:
                                continue
                            assert found.indentation > 0 and found.contact_area > 0 and found.peak_pressure > 0
                            assert np.isfinite(found.reading).all() and found.force_balance < 1e-6
