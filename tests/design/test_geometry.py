"""What a geometry takes from its neighbour, and what a design lacks: large strain."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.calibration.fitting.sweep import DEFAULT_MODULI
from papilla.core.errors import InputError
from papilla.design.geometry import GeometryMap, _table_of, measure_base, with_sites
from papilla.design.in_scene import MESH, DesignInScene
from papilla.design.parameters import made
from papilla.design.places import Places
from papilla.design.scene import Scene
from papilla.fem.pressing.large_strain import CONTINUED_GAUGE, CONTINUED_SD, known
from papilla.model.finger import Finger, Layer


def test_a_finger_a_third_as_large_has_the_large_strain_of_the_default(tmp_path, monkeypatch):
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path))
    default = Finger.default()
    small = made(default, {"shape.scale": 1 / 3})
    foil = {"length_mm": 0.8, "width_mm": 2 / 3, "backing_mm": (1.6, 2 / 3)}
    small = replace(small, gauges=tuple(replace(one, **foil) for one in small.gauges))
    base = with_sites(small, Places.of(small))
    assert not known(base.strain_sha256)
    assert measure_base(base, 1, pytest.fail) == ""
    found, shipped = (known(one.strain_sha256) for one in (base, default))
    assert shipped
    for one, other in zip(found, shipped, strict=True):
        assert one.force == pytest.approx(other.force / 9) and one.modulus == pytest.approx(other.modulus)
        gauges = len(default.gauges)
        strain, curvature = np.split(one.finite[:, 3:] / other.finite[:, 3:], [gauges], axis=1)
        assert strain == pytest.approx(1.0) and curvature == pytest.approx(3.0)


def test_a_hard_inner_layer_leaves_more_of_a_calibration_beyond_its_tables(made_up_geometry, monkeypatch):
    finger = Finger.default()
    places = Places.of(finger)
    free, stuck = made_up_geometry(with_sites(finger, places), places).ends
    measured = GeometryMap(finger, places, (replace(free, large_strain=True), replace(stuck, large_strain=True)))

    def of(inner: float) -> DesignInScene:
        return DesignInScene(replace(finger, inner=Layer(inner)), measured, Scene((0.37, 0.98)))

    # The tables begin at F / E_inner = 0.9 mm2 with a margin of 5 %, forces of a calibration at 0.05 N
    swept = np.array(Scene((0.37, 0.98)).swept_N)
    monkeypatch.setattr(GeometryMap, "strain_error", lambda *_: 0.0)
    for inner in (0.034, 0.08):
        share = np.sqrt(np.mean(swept / inner < 0.9 * np.exp(-0.05)))
        assert (share == 0) == (inner == 0.034)
        sd, gauges = of(inner).errors
        without_sd, without = replace(of(inner), geometry=GeometryMap(finger, places, (free, stuck))).errors
        force, modulus = (
            one.ravel() for one in np.meshgrid(swept[::6], [m for m in DEFAULT_MODULI[::3] if m >= inner / 2])
        )
        felt = stuck.felt(force, modulus, finger.outer.modulus, inner).values[:, 0] / force[:, None]
        assert sd**2 - without_sd**2 == pytest.approx((CONTINUED_SD * share) ** 2, abs=1e-12)
        size = 1e6 * np.sqrt(np.mean(felt**2, axis=0))
        assert np.sqrt(gauges**2 - without**2) == pytest.approx(CONTINUED_GAUGE * share * size, rel=1e-6)
        assert without == pytest.approx(MESH * size, rel=1e-6)


def test_the_error_of_the_tables_is_that_of_a_calibration_for_the_same_gauges():
    finger = Finger.default()
    places = Places.of(finger)
    site = with_sites(finger, places)
    tables = [one for one in known(site.strain_sha256) if one.friction > 0]
    assert tables
    response = SimpleNamespace(large_strain=True)
    found = GeometryMap(site, places, (response, response)).strain_error(finger, True)
    weights = np.array([[1.0] * 5, [0.0] * 5])
    at_four = next(one for one in tables if abs(one.ratio - 4) < 1e-3)
    assert found == pytest.approx(at_four.sd_error(weights))
    # A gauge between two sites is their weighted sum
    table = _table_of(at_four, np.array([[0.5], [0.5], [0.0], [0.0], [0.0]]))
    assert table.finite[:, 3:] == pytest.approx(
        np.stack([at_four.finite[:, 3:5].mean(axis=1), at_four.finite[:, 8:10].mean(axis=1)], axis=1)
    )


@pytest.mark.parametrize("inner, begins", [(0.034, "begins at 0.02 MPa"), (0.4, "begins at 0.2"), (20.0, "has no")])
def test_a_specimen_below_the_first_modulus_of_a_calibration_is_refused(made_up_geometry, inner, begins):
    finger = Finger.default()
    places = Places.of(finger)
    free, stuck = made_up_geometry(with_sites(finger, places), places).ends
    measured = GeometryMap(finger, places, (replace(free, large_strain=True), replace(stuck, large_strain=True)))
    stiff = replace(finger, inner=Layer(inner), outer=Layer(4 * inner))
    with pytest.raises(InputError, match=f"too soft for an inner layer of {inner:.3g} MPa.* a calibration {begins}"):
        _ = DesignInScene(stiff, measured, Scene(modulus_MPa=(0.019, 0.72))).ends
