"""Other libraries make the same press: they must agree with papilla's contact, and say so where they are missing."""

import json
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from benchmarks.presses.peers import missing_peers, run_peers
from benchmarks.presses.peers.library import PEERS, Elastic, Peer, PeerLibrary, PeerScene
from benchmarks.presses.peers.runner import CONVERGED, INDENTATION_MM, RIGID_MPA
from papilla.core.errors import MissingExtraError, SolverError
from papilla.fem import FingerModel, press
from papilla.mesh import build
from papilla.mesh.layered import LayeredMesh
from papilla.model.finger import Finger
from papilla.model.specimen import HalfSpace

NAMES = [peer.name for peer in PEERS]


@pytest.fixture(scope="module")
def finger() -> Finger:
    return Finger.default()


@pytest.fixture(scope="module")
def mesh(finger) -> LayeredMesh:
    return build(finger, 2.8)


@pytest.fixture(scope="module")
def quarter(finger, mesh) -> PeerScene:
    return PeerScene(FingerModel(finger, mesh), INDENTATION_MM)


@pytest.fixture(scope="module")
def ours(finger, mesh):
    """papilla's own press."""
    reduced = FingerModel(finger, mesh).reduce()
    return press(reduced, HalfSpace(RIGID_MPA), indentation=INDENTATION_MM, fidelity="contact")


def installed(name: str) -> Peer:
    """The peer of that name; skips the test, with the reason, where it is not installed."""
    peer = PEERS[NAMES.index(name)]
    if peer.missing is not None:
        pytest.skip(peer.missing)
    return peer


def test_the_scene_that_libraries_get(quarter):
    """A quarter: clamped or held across its mirror planes; what may touch lies around the apex, with no gap there."""
    held, nodes = quarter.held, quarter.nodes
    planes = np.column_stack([nodes[:, 0] == 0, nodes[:, 1] == 0, np.zeros(len(nodes), bool)])
    assert (held == (planes | held.all(axis=1)[:, None])).all(), "clamped, or held across a mirror plane"
    assert quarter.multiplicity == 4 and len(quarter.contact_triangles) > 20
    assert quarter.contact_gaps.min() == pytest.approx(0, abs=1e-9) and quarter.contact_gaps.max() > INDENTATION_MM
    assert (quarter.first_guess[held] == 0).all() and quarter.first_guess.sum() < 0, "it begins pressed down"


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_rows_of_the_quarter_and_of_the_whole_finger(name, finger, mesh, ours):
    rows = run_peers(finger, mesh, threads=1, peers=[installed(name)])
    assert [row.name for row in rows] == [f"{name}, quarter by symmetry", f"{name}, whole finger"]
    for row in rows:
        assert row.force_papilla_N == pytest.approx(ours.force, rel=1e-12)
        assert abs(row.difference) < 0.02 and abs(row.difference_sd) < 0.02
        assert row.difference == pytest.approx(row.force_N / ours.force - 1, rel=1e-9)
        assert 0 < abs(row.penalty_change) <= CONVERGED
        assert row.seconds_one_press > row.seconds_assembly > 0
    # A node in a mirror plane has its whole penalty on every side of it, where contact is by nodes
    assert rows[0].force_N == pytest.approx(rows[1].force_N, rel=CONVERGED if "FElupe" in name else 1e-9)
    assert rows[1].unknowns > 3 * rows[0].unknowns
    assert json.loads(json.dumps(rows[0].to_json()))["penalty_sweep"][-1][1] > rows[0].force_N


@pytest.mark.parametrize("name", NAMES)
def test_scaled_moduli_scale_the_force_and_nothing_else_and_a_stiffer_skin_is_felt(name, finger, mesh, quarter):
    def press(**factors):
        layers = {layer: replace(getattr(finger, layer), modulus=k * getattr(finger, layer).modulus)
                  for layer, k in factors.items()}  # fmt: skip
        scene = replace(quarter, model=FingerModel(replace(finger, **layers), mesh))
        return installed(name).prepare(scene, 1).press(100.0)

    plain, scaled = press(), press(outer=256, inner=256)
    assert scaled.force == pytest.approx(256 * plain.force, rel=1e-8) and scaled.systems == plain.systems
    np.testing.assert_allclose(scaled.displacement, plain.displacement, atol=1e-8 * INDENTATION_MM)
    assert press(outer=4).force > 1.5 * plain.force


def test_gauges_read_a_uniform_stretch(finger, quarter, mesh):
    whole = PeerScene(FingerModel(finger, replace(mesh, mirrors=())), INDENTATION_MM)
    stretch = np.array([1e-3, -2e-3, 1e-3])
    assert quarter.sd(quarter.nodes * stretch) == pytest.approx(whole.sd(whole.nodes * stretch), rel=1e-9)
    assert whole.sd(np.zeros_like(whole.nodes)) == 0


def test_a_missing_package_is_named_with_the_extra(finger, mesh, quarter):
    absent = Peer("Absent", ("numpy", "no_such_package"), ("not.imported", "Nothing"))
    (sentence,) = missing_peers([absent])
    assert sentence == "Absent: no no_such_package; pip install 'papilla[peers]'"
    with pytest.raises(MissingExtraError, match=r"no_such_package; pip install 'papilla\[peers\]'"):
        absent.prepare(quarter, 1)
    assert run_peers(finger, mesh, peers=[absent]) == ()


def test_contact_that_does_not_settle_is_refused():
    """A contact that pushes the more, the further it is yielded to."""

    class Chasing(PeerLibrary):
        free, start = np.array([True]), np.zeros(1)

        def assemble(self):
            return Elastic(lambda x: x, lambda added, rhs: -rhs)

        def contact(self, penalty):
            return lambda x: (x + 1, lambda: sp.coo_matrix((1, 1)))

        def told(self, unknowns, forces):
            pytest.fail("there is nothing to tell")

    with pytest.raises(SolverError, match="Chasing: contact did not settle in 40 Newton steps"):
        Chasing().press(1.0)
