"""Surfaces: the spline's arithmetic, the fit, what can be inverted, mesh scatter."""

import numpy as np
import pytest

from papilla.calibration.fitting.surface_fit import (
    Fitted,
    Resolution,
    SurfaceFit,
    table_resolution,
    uncertainty,
    usable_part,
)
from papilla.core.errors import InputError


def points(surface, count=200):
    rng = np.random.default_rng(5)
    return (np.exp(rng.uniform(*np.log(limits), count)) for limits in (surface.force_N, surface.modulus_MPa))


def test_a_cubic_is_reproduced_exactly():
    """B-splines hold every bicubic polynomial of the logarithms, whatever the cells."""
    force, modulus = (column.ravel() for column in np.meshgrid(np.geomspace(0.1, 2, 30), np.geomspace(0.05, 3, 30)))

    def cubic(f, E):
        return 1 + np.log(f) ** 3 - 2 * np.log(f) * np.log(E) ** 2 + 0.5 * np.log(E) ** 3

    for along in ((Resolution(9), Resolution(14)), (Resolution(5, 3), Resolution(16, 3))):
        found = SurfaceFit(force, modulus, along).surface(cubic(force, modulus))
        f, E = points(found.surface)
        np.testing.assert_allclose(found.surface(f, E), cubic(f, E), atol=1e-9)
        assert found.largest < 1e-9 and found.rms < 1e-9


def test_few_values_get_a_polynomial_and_many_get_cells():
    assert table_resolution(np.array([1, 2, 2, 3])).degree == 2
    assert table_resolution(np.arange(1, 9)).degree == 3
    assert table_resolution(np.arange(1, 41)).cells == 36


def test_a_surface_needs_variation():
    with pytest.raises(InputError, match="two moduli at least, got 1"):
        SurfaceFit(np.array([0.1, 0.2]), np.array([1.0, 1.0]), (Resolution(16, 1), Resolution(16, 1)))


def test_residual_rms_estimates_the_noise():
    force, modulus = (part.ravel() for part in np.meshgrid(np.geomspace(0.1, 1, 40), np.geomspace(0.05, 3, 30)))
    rng = np.random.default_rng(0)
    solver = SurfaceFit(force, modulus, (Resolution(16, 3), Resolution(8)))
    found = [solver.surface(np.log(force) + rng.normal(scale=0.01, size=len(force))).rms for _ in range(20)]
    # 44 parameters at most over 1200 presses: 2 % are for the surface's own error.
    assert np.mean(found) == pytest.approx(0.0102, rel=0.02)


def rising_then_falling(turn, cells=(4, 40)):
    """ln S_d = -(ln E - turn)^2 on the domain 0.1-1 N, 0.05-3 MPa."""
    force, modulus = (part.ravel() for part in np.meshgrid(np.geomspace(0.1, 1, 30), np.geomspace(0.05, 3, 80)))
    solver = SurfaceFit(force, modulus, (Resolution(cells[0], 1), Resolution(cells[1], 2)))
    return solver.surface(-((np.log(modulus) - turn) ** 2)).surface


def test_only_the_rising_part_is_usable_and_its_double_values_are_marked():
    surface = rising_then_falling(turn=0.0)
    usable, twofold = usable_part(surface)
    nodes = surface.modulus_axis.nodes
    assert (usable[:, 0] == 0).all()
    assert (nodes[usable[:, 1]] <= 1.0 + 1e-9).all() and (nodes[usable[:, 1]] > 0.85).all()
    # Falling cells reach down to the value at 3 MPa, -(ln 3)^2, and up to the top.
    assert twofold[:, 0] == pytest.approx([-(np.log(3) ** 2)] * 4, abs=0.01)
    assert twofold[:, 1] == pytest.approx([0] * 4, abs=0.01)


def test_what_is_missing_or_falls_is_not_usable():
    """A press without readings takes the cells up to its neighbours in the table with it."""
    surface = rising_then_falling(turn=np.log(4.0), cells=(9, 9))
    forces, moduli = surface.force_axis.nodes, surface.modulus_axis.nodes
    usable, twofold = usable_part(surface, forces[[8, 9]], moduli[[0, 0]], forces, moduli)
    assert usable[:7].tolist() == [[0, 9]] * 7 and usable[7:].tolist() == [[1, 9]] * 2
    assert np.isnan(twofold).all()
    falling, _ = usable_part(rising_then_falling(turn=np.log(0.04)))
    assert (falling[:, 0] == falling[:, 1]).all()


def test_scatter_is_what_other_meshes_differ_by():
    surface = rising_then_falling(turn=np.log(4.0))
    rng = np.random.default_rng(1)
    force, modulus = np.exp(rng.uniform(np.log(0.1), 0, 3000)), np.exp(rng.uniform(np.log(0.05), np.log(3), 3000))
    size = np.where(force < 0.3, 0.03, 0.01)
    others = [(force, modulus, surface(force, modulus) + sign * size) for sign in (1, -1, 1)]
    known = uncertainty(Fitted(surface, 0.001, 2.0, np.full(3, 0.002)), others)
    # Eight bins, each known at its middle
    np.testing.assert_allclose(np.log10(known.scatter_force_N), -1 + (np.arange(8) + 0.5) / 8, atol=1e-12)
    assert known.meshes == 3 and 1.96 < known.scatter_factor < 2.2
    here = uncertainty(Fitted(surface, 0.001, 2.0, np.full(3, 0.002)), others, one_site=True)
    assert here.scatter_factor == pytest.approx(3.182, rel=1e-3)
    assert here.sigma_at(0.12) == pytest.approx(np.hypot(0.001, 0.03 * 3.182 / 1.96), rel=1e-3)
    assert known.scatter_at(0.12) == pytest.approx(0.03, rel=1e-6)
    assert known.scatter_at(0.9) == pytest.approx(0.01, rel=1e-6)
    # Bins without a press are left out, and the others keep theirs
    light = force < 0.1 * 10 ** (3 / 8)
    some = uncertainty(Fitted(surface, 0.001, 2.0, np.full(3, 0.002)), [[part[light][:50] for part in others[0]]])
    assert some.scatter == pytest.approx([0.03] * 3) and some.scatter_force_N == pytest.approx(
        known.scatter_force_N[:3]
    )
    with pytest.raises(InputError, match="share no force and modulus"):
        uncertainty(Fitted(surface, 0.0, 2.0, np.zeros(3)), [(force + 5, modulus, modulus)])
