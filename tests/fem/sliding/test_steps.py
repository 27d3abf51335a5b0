"""How many steps a scene takes, and what its status says, just inside of each limit and just beyond it."""

import numpy as np
import pytest

from papilla import Grating
from papilla.core.errors import InputError
from papilla.fem import Motion
from papilla.fem.sliding.coulomb import Rubbed
from papilla.fem.sliding.felt_profile import FAR_MM
from papilla.fem.sliding.slide import _Run, amplify
from papilla.model.textures import Flat


@pytest.fixture
def run(coarse):
    """Function: the scene of a motion in equal steps (mm) at a rate (Hz) on a texture."""

    def made(path=0.01, rate=1000.0, texture=None, dynamics="quasi-static", samples=5):
        motion = Motion(np.arange(samples) / rate, path * np.arange(samples), rate)
        loss = np.full(len(coarse.modes.omega), 0.1), "as stated"
        return _Run(coarse, coarse.reading_rows, texture or Flat(), motion, 0.02, None, 0.0, dynamics, loss)

    return made


@pytest.mark.parametrize("path, steps", [(0.0499, 1), (0.0501, 2), (0.0999, 2), (0.1001, 3), (-0.0501, 2)])
def test_a_step_slides_a_twentieth_of_a_millimetre_at_most(run, path, steps):
    assert run(path).substeps == steps


@pytest.mark.parametrize("path, steps", [(0.0399, 1), (0.0401, 2)])
def test_a_period_of_a_fine_grating_takes_eight_steps_at_least(run, path, steps):
    assert run(path, texture=Grating(0.16, 0.16, 0.05)).substeps == steps


@pytest.mark.parametrize("rate, steps", [(3850.0, 1), (3840.0, 2), (1000.0, 4)])
def test_with_inertia_a_step_lasts_026_ms_at_most(run, rate, steps):
    assert run(rate=rate, dynamics="modal").substeps == steps
    assert run(rate=rate).substeps == 1


def test_a_scene_of_more_than_two_million_steps_is_refused(run):
    wide = Grating(0.9, 0.9, 0.05)
    assert run(path=49_990.0, samples=2, texture=wide).substeps == 999_800
    with pytest.raises(InputError, match="more than 2,000,000 steps: slide less far"):
        run(path=50_010.0, samples=2, texture=wide)


def test_each_cause_of_doubt_is_told_from_its_limit_on(run, coarse):
    made, tissue = run(), float(coarse.z.max()) - coarse.bone_top
    made.in_groove = 0.199
    assert made._status(True, 0.0999 * tissue) == "ok"
    assert made._status(False, 0.0) == "no contact: the finger does not reach the texture"
    assert made._status(True, 0.1001 * tissue) == (
        "doubtful: pressed by 10% of the tissue, where small strain is doubtful"
    )
    made.in_groove, made.unresolved = 0.201, 3
    assert made._status(True, 0.0) == (
        "doubtful: 3 steps do not fulfil the laws of contact; "
        "skin stands up to 0.2 mm deep in grooves: the flanks' sideways push is not modelled"
    )


def test_the_amplifier_passes_up_to_four_tenths_of_the_rate():
    """Half of the amplitude is left there; a little below nearly all, a little above nearly nothing."""
    t = np.arange(16_000) / 4000.0
    for share, left in ((0.40, 0.5), (0.36, 1.0), (0.44, 0.0)):
        heard = amplify(np.sin(2 * np.pi * share * 1000 * t)[:, None], 4)[200:-200, 0]
        assert np.sqrt(2 * np.mean(heard**2)) == pytest.approx(left, abs=0.04)
    signal = np.arange(6.0)[:, None]
    assert amplify(signal, 1) is signal


def test_skin_stands_no_deeper_than_a_groove_and_nowhere_beside_the_texture(run, coarse):
    made, n = run(texture=Grating(0.9, 0.9, 0.5)), len(coarse.x)
    middle = n // 2
    force, moved, recess = np.zeros(2 * n), np.zeros(2 * n), np.full(n, FAR_MM)
    force[n + middle - 1 : n + middle + 2] = 1.0
    recess[middle], depth = 0.03, float(made.rise[middle]) + 0.05
    made._watch(Rubbed(force, moved, depth, np.zeros(n), 1, "newton", 0.0), coarse.x, recess)
    assert made.in_groove == pytest.approx(0.03)
    recess[middle] = 0.07
    made._watch(Rubbed(force, moved, depth, np.zeros(n), 1, "newton", 0.0), coarse.x, recess)
    width = coarse.x[middle + 1] - coarse.x[middle - 1] + coarse.hats.max()
    assert made.in_groove == pytest.approx(0.05) and made.flank_push == pytest.approx(0.05 / width) and width < 1.8
