"""The `finite` rung: the linear limit, work, units, mirrors that remain, and what it refuses."""

import dataclasses

import numpy as np
import pytest
from scaled_finger import scaled_finger, without_lengths

from papilla.core.errors import ContactRangeError, InputError
from papilla.fem import FingerModel, prepare, press
from papilla.fem.finite import press_finite
from papilla.fem.finite.pressing import PressProblem, press_path
from papilla.fem.reduction.family import with_moduli
from papilla.mesh import build, default_size_mm
from papilla.model.finger import DEFAULT_FINGER, Finger
from papilla.model.materials import NeoHookean
from papilla.model.specimen import Block, HalfSpace, Sphere


@pytest.mark.parametrize("at", [(3.0, 0.0), (0.0, 4.0), pytest.param((3.0, 2.0), marks=pytest.mark.slow)])
def test_beside_the_apex_it_uses_the_mirrors_that_remain(coarse, at):
    finger, mesh = coarse
    reduced = FingerModel(finger, mesh).reduce(at)
    linear = press(reduced, HalfSpace(0.51), force=1e-4, fidelity="contact")
    finite = press_finite(finger, mesh, HalfSpace(0.51), force=1e-4, at=at)
    assert finite.indentation == pytest.approx(linear.indentation, rel=1e-3)
    assert finite.reading == pytest.approx(linear.reading, abs=1e-3 * np.abs(linear.reading).max())


@pytest.mark.slow
@pytest.mark.parametrize("specimen, bound", [(HalfSpace(1e6), 1e-6), (Sphere(1e6, 30), 1e-6)], ids=repr)
def test_the_work_of_a_rigid_specimen_is_the_energy_of_the_finger(coarse, energy_of, specimen, bound):
    scene = PressProblem.of(*coarse, specimen, {}, (0.0, 0.0))
    energies, forces = [], []
    for depth in (0.799, 0.8, 0.801):
        state = press_path(scene, None, depth)[0]
        energies.append(energy_of(scene.body, state.displacement, state.pressure))
        forces.append(scene.touching.patch.mass @ state.contact)
    assert (energies[2] - energies[0]) / 0.002 == pytest.approx(forces[1], rel=bound)


@pytest.mark.parametrize("stress", [1e6, pytest.param(1e-6, marks=pytest.mark.slow)])
def test_units_of_stress_do_not_matter(coarse, stress):
    finger, mesh = coarse
    here = press_finite(finger, mesh, Block(0.51, 10), force=0.4)
    other = with_moduli(finger, stress * finger.outer.modulus, stress * finger.inner.modulus)
    there = press_finite(other, mesh, Block(0.51 * stress, 10), force=0.4 * stress)
    by_depth = press_finite(finger, mesh, Block(0.51, 10), indentation=here.indentation)
    assert by_depth.force == pytest.approx(0.4, rel=1e-7) and here.force_balance < 1e-9
    assert there.status.split(", relative")[0] == here.status.split(", relative")[0]
    assert there.reading == pytest.approx(here.reading, rel=1e-7)
    assert there.indentation == pytest.approx(here.indentation, rel=1e-8)
    assert there.peak_pressure == pytest.approx(here.peak_pressure * stress, rel=1e-7)


@pytest.mark.parametrize(
    "change, error, message",
    [
        ({"indentation": 1.0}, InputError, "give exactly one of force and indentation"),
        ({"materials": {"skin": NeoHookean(1)}}, InputError, "materials are for outer, inner, got 'skin'"),
        ({"materials": {"outer": 0.1}}, InputError, "material of outer must be NeoHookean, .*, got float"),
        ({"at": (40.0, 0.0)}, InputError, "no skin to touch at x 40, y 0 mm"),
        ({"at": (float("nan"), 0.0)}, InputError, r"at x \(mm\) must be finite"),
        ({"force": None, "indentation": 1e-9}, ContactRangeError, "an indentation of 1e-09 mm makes no contact"),
    ],
)
def test_refusals_are_one_clear_line(coarse, change, error, message):
    scene = {"specimen": HalfSpace(0.51), "force": 0.1} | change
    with pytest.raises(error, match=message):
        press_finite(*coarse, scene.pop("specimen"), **scene)


@pytest.mark.parametrize("length, stress", [(0.3, 10.0), pytest.param(3.0, 0.1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("shape", ["dome", pytest.param("slab", marks=pytest.mark.slow)])
def test_a_press_knows_no_unit_of_length_or_stress(shape, length, stress):
    finger = Finger.load(DEFAULT_FINGER.with_name(f"{shape}_finger.toml"))

    def answers(finger, length, stress):
        size = (4 if shape == "dome" else 2) * default_size_mm(finger)
        reduced, scene = prepare(finger, size_mm=size), (Block(0.2 * stress, 10 * length), 0.1 * length**2 * stress)
        linear = press(reduced, scene[0], force=scene[1], friction=0, fidelity="contact")
        finite = press_finite(finger, build(finger, size), scene[0], force=scene[1])
        return [
            np.array([*p.reading, p.indentation / length, p.contact_area / length**2, p.peak_pressure / stress])
            for p in (linear, finite)
        ], (linear.resolved, *map(without_lengths, (linear.status, finite.status)))

    (linear, finite), words = answers(scaled_finger(finger, length, stress), length, stress)
    (plain_linear, plain_finite), plain_words = answers(finger, 1.0, 1.0)
    assert linear == pytest.approx(plain_linear, rel=1e-6) and words == plain_words
    assert finite == pytest.approx(plain_finite, rel=1e-5)


def test_contact_at_the_rim_of_its_patch_is_refused(coarse):
    finger, mesh = coarse
    with pytest.raises(ContactRangeError, match="the contact reaches the rim of its patch"):
        press_finite(dataclasses.replace(finger, patch_radius=7.0), mesh, HalfSpace(0.51), force=2.0)


@pytest.mark.slow
def test_friction_grows_with_its_coefficient_from_none_to_stick(coarse):
    finger, mesh = coarse
    scene = {"specimen": HalfSpace(0.51), "force": 0.6}
    free = press_finite(finger, mesh, **scene)
    found = [press_finite(finger, mesh, **scene, friction=mu) for mu in (1e-9, 0.1, 5.0, "stick")]
    assert found[0].sd == pytest.approx(free.sd, rel=3e-3)
    assert found[0].sd > found[1].sd > found[3].sd and found[2].sd == pytest.approx(found[3].sd, rel=1e-3)
    assert found[3].indentation < free.indentation and found[3].force_balance < 1e-9


class Unstable(NeoHookean):
    """The same rubber, which says of itself that it is unstable."""

    def stability(self, stretches):
        return -np.ones(np.shape(stretches)[:-1])


def test_the_stability_of_the_laws_over_the_strains_reached_is_said(coarse):
    finger, mesh = coarse
    stable = press_finite(finger, mesh, HalfSpace(0.51), force=0.5)
    assert "laws stable over the strains reached, stretches up to 1." in stable.status
    weak = press_finite(finger, mesh, HalfSpace(0.51), force=0.5, materials={"outer": Unstable(0.136 / 3)})
    assert "not to be trusted: a material's law is unstable within the stretches reached" in weak.status


class Upright(HalfSpace):
    """A half-space that knows how it answers pressure, and nothing of tractions along its surface."""

    def compliance(self, surface):
        return super().compliance(surface)


class Softer(Block):
    """A block of half its stiffness, which does not say how it answers tractions along its surface."""

    def compliance(self, surface):
        return 2 * super().compliance(surface)


def test_a_specimen_without_an_answer_along_its_surface_says_that_pressure_keeps_its_direction(coarse):
    words = "the pressure keeps its direction where the specimen deforms"
    specimens = HalfSpace(0.1), Upright(0.1), Block(0.1, 10, bonded=False)
    turned, upright, sliding = (press_finite(*coarse, specimen, force=0.3) for specimen in specimens)
    assert words not in turned.status and words in upright.status and words in sliding.status
    assert turned.sd > 1.001 * upright.sd, "turned pressure strains the finger more"
    softer = press_finite(*coarse, Softer(0.2, 10), force=0.3)
    assert words in softer.status and softer.sd == pytest.approx(
        press_finite(*coarse, Block(0.1, 10), force=0.3).sd, rel=0.01
    )
