"""The `hertz` rung: Hertz's own result on a half-space, its limits, and its agreement with contact where both hold."""

import dataclasses

import numpy as np
import pytest

from papilla.core.errors import ContactRangeError
from papilla.fem import press
from papilla.fem.pressing.contact import contact_press
from papilla.fem.pressing.hertz import hertz_table
from papilla.model.specimen import Block, HalfSpace
from papilla.references import hertz_ellipse_at

E_STAR = 0.15
SOFT = HalfSpace(0.3, 0.4)
TOGETHER = 1 / (1 / E_STAR + (1 - 0.4**2) / 0.3)


@pytest.fixture(scope="module", params=[(12.0, 12.0), (9.0, 16.0), (20.0, 11.0)], ids=str)
def half_space(request, disc, stand_in):
    """A half-space finger of two radii of curvature, and these radii."""
    rx, ry = request.param
    return stand_in(disc(4.0, 20, lambda x, y: x**2 / (2 * rx) + y**2 / (2 * ry)), E_STAR), rx, ry


@pytest.mark.parametrize("indentation", [1e-5, 1e-3, 0.02, 0.1, 0.4])
def test_is_hertz_on_a_half_space(half_space, indentation):
    finger, rx, ry = half_space
    exact = hertz_ellipse_at(indentation, rx, ry, TOGETHER)
    found = press(finger, SOFT, force=exact.force, fidelity="hertz")
    assert found.indentation == pytest.approx(indentation, rel=1e-3)
    assert found.contact_area == pytest.approx(exact.area, rel=1e-3)
    assert found.peak_pressure == pytest.approx(exact.peak_pressure, rel=1e-3)
    by_depth = press(finger, SOFT, indentation=indentation, fidelity="hertz")
    assert by_depth.force == pytest.approx(exact.force, rel=2e-3)
    assert by_depth.indentation == pytest.approx(indentation, rel=1e-12)
    again = press(finger, SOFT, force=by_depth.force, fidelity="hertz")
    assert again.strain == pytest.approx(by_depth.strain, rel=1e-9)
    # The gauges of the stand-in read force and second moments; the projection onto the patch smooths a small ellipse
    assert found.curvature == pytest.approx([exact.force, 0, 0], rel=1e-9, abs=1e-15)
    if indentation >= 0.05:
        moments = exact.force * np.array([1, exact.a**2 / 5, exact.b**2 / 5])
        assert found.strain == pytest.approx(moments, rel=0.01)


def test_the_ellipses_of_a_cached_finger_are_computed_once_for_all_processes(coarse, tmp_path, monkeypatch):
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path))
    finger, block = coarse, Block(0.3, 10.0)

    def cached(**changed):
        return dataclasses.replace(finger, cached=True, **changed)

    made, *kept = (press(one, block, force=0.1, fidelity="hertz") for one in (finger, cached(), cached()))
    for other in kept:
        assert (other.values == made.values).all() and other.indentation == made.indentation
    counts, cases = [], [(cached(), block), (cached(), Block(0.9, 10.0)), (cached(rows=2 * finger.rows), block)]
    for another, pressed in (*cases, (cached(), Block(0.3, 9.0))):
        press(another, pressed, force=0.1, fidelity="hertz")
        counts.append(len(list(tmp_path.rglob("*.entry"))))
    assert 0 < counts[0] == counts[1] < counts[2] < counts[3], "any modulus has the same ellipses"


def test_an_ellipse_beyond_the_patch_is_refused(half_space, reference):
    finger, rx, ry = half_space
    limit = hertz_table(finger, SOFT).force[-1]
    press(finger, SOFT, force=0.999 * limit, fidelity="hertz")
    with pytest.raises(ContactRangeError, match="a force of .* N takes the contact to the rim of its patch"):
        press(finger, SOFT, force=1.001 * limit, fidelity="hertz")
    with pytest.raises(ContactRangeError, match="an indentation of 9 mm takes the contact to the rim"):
        press(reference, SOFT, indentation=9.0, fidelity="hertz")


def test_a_skin_that_is_not_convex_is_refused(disc, stand_in):
    saddle = stand_in(disc(4.0, 10, lambda x, y: x**2 / 20 - y**2 / 200), E_STAR)
    with pytest.raises(ContactRangeError, match="hertz fidelity needs a skin that is convex"):
        press(saddle, SOFT, force=0.01, fidelity="hertz")


@pytest.fixture(scope="module")
def coarse(disc, stand_in):
    """A half-space finger of two radii of curvature on elements of 0.4 mm."""
    return stand_in(disc(4.0, 10, lambda x, y: x**2 / 18 + y**2 / 32), E_STAR)


@pytest.mark.parametrize("indentation", [0.04, 0.06, 0.1])
def test_a_light_press_is_hertz_where_its_nodes_are_not(coarse, indentation):
    exact = hertz_ellipse_at(indentation, 9.0, 16.0, TOGETHER)
    nodes, found = (
        make(coarse, SOFT)
        for make in (
            lambda *scene: contact_press(*scene, (exact.force, None), 0.0),
            lambda *scene: press(*scene, force=exact.force, fidelity="contact"),
        )
    )
    truth = {"indentation": indentation, "contact_area": exact.area, "peak_pressure": exact.peak_pressure}
    lost, left = ({name: abs(getattr(one, name) / true - 1) for name, true in truth.items()} for one in (nodes, found))
    assert max(lost.values()) > 5e-3
    assert max(left.values()) < 0.5 * max(lost.values())
    # The gauges of the stand-in read force and second moments
    assert found.strain[0] == pytest.approx(exact.force, rel=1e-3)
    moments = exact.force * np.array([exact.a**2, exact.b**2]) / 5
    assert np.abs(found.strain[1:] / moments - 1).max() < 0.5 * np.abs(nodes.strain[1:] / moments - 1).max() + 2e-3
