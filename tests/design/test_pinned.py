"""Numbers of a study on the made-up geometry, pinned: they were computed by papilla when this test was written, and
have no other origin. Where they change, a constant or a formula of the expected sigma has changed."""

import numpy as np
import pytest

from papilla.design.geometry import with_sites
from papilla.design.in_scene import DesignInScene
from papilla.design.influence import Influence
from papilla.design.objectives import OBJECTIVES
from papilla.design.placement import UNKNOWN, place, problem
from papilla.design.places import Places
from papilla.design.scene import Scene, Tolerances, Unknowns
from papilla.design.study import Limit, Sampler
from papilla.model.finger import Finger, Gauge

FINGER = Finger.default()
NAMES = [name for name in OBJECTIVES if name not in ("force_at_depth", "worst_over_tolerances")]
SCENES = {
    "default": Scene(),
    "rms": Scene(over="rms", samples=10, forces=4, moduli=6),
    "stick": Scene(unknown=Unknowns("stick"), gauge_noise_microstrain=20.0, force_noise_N=0.02),
    "none": Scene((0.3, 0.6), (0.1, 0.4), unknown=Unknowns(0), depth_noise_mm=0.02),
}
PINNED = {
    "default": {
        "identifiable_share": 0.6,
        "largest_strain": 0.2189661,
        "sigma_force_depth": 0.8427344,
        "sigma_gauges": 0.5587223,
        "sigma_sd": 0.6701459,
        "signal_over_noise": 7683.49,
        "specimens_told_apart": 2.992173,
    },
    "rms": {
        "identifiable_share": 0.6666667,
        "largest_strain": 0.2189661,
        "sigma_force_depth": 0.4227627,
        "sigma_gauges": 0.3868058,
        "sigma_sd": 0.4831518,
        "signal_over_noise": 7683.49,
        "specimens_told_apart": 2.989717,
    },
    "stick": {
        "identifiable_share": 0.6,
        "largest_strain": 0.2189661,
        "sigma_force_depth": 0.8431112,
        "sigma_gauges": 0.5441639,
        "sigma_sd": 0.6599896,
        "signal_over_noise": 1920.873,
        "specimens_told_apart": 3.088908,
    },
    "none": {
        "identifiable_share": 0.8,
        "largest_strain": 0.1358842,
        "sigma_force_depth": 0.5685779,
        "sigma_gauges": 0.424595,
        "sigma_sd": 0.5400212,
        "signal_over_noise": 12293.2,
        "specimens_told_apart": 2.075944,
    },
}
READ = (0.057143456, 0.11253581, 1.1692128, 2.25034)
BY_MODULUS = (-0.0081159281, -0.16975841, -0.10563963, -3.3317724)
ERRORS = {
    0.034: (0.01009567, 901.1603, 1334.122, 2450.846, 1334.122, 901.1603),
    0.25: (0.01160093, 232.9282, 388.5921, 699.0118, 388.5921, 232.9282),
}
PLACED = {
    "friction and place unknown": [0.4803677, 0.2442321, 0.1451313],
    "place unknown": [0.4629102, 0.2294002, 0.1256285],
    "friction unknown": [0.2235367, 0.1432327, 0.1195207],
    "neither": [0.1468841, 0.1163929, 0.0972895],
}


@pytest.mark.parametrize("name", SCENES)
def test_objectives_of_the_made_up_geometry(made_up_geometry, name):
    places = Places.of(FINGER)
    design = DesignInScene(FINGER, made_up_geometry(with_sites(FINGER, places), places), SCENES[name])
    found = {one: OBJECTIVES[one].of(design) for one in NAMES}
    assert found == pytest.approx(PINNED[name], rel=1e-5)


def test_sigma_of_placed_gauges():
    rng = np.random.default_rng(5)
    gauges = tuple(Gauge(f"p{k}", angle_deg=0.0, backing_mm=(5.0, 2.0)) for k in range(8))
    sites = np.column_stack([7.0 * np.arange(8), np.zeros(8), np.ones(8)])
    slopes = rng.normal(0, 500, (5, 2, 8))
    found = Influence(gauges, sites, rng.normal(0, 900, (2, 8)), slopes, np.array([0.2, 0.8]))
    sigma = {}
    for name, (friction, somewhere) in UNKNOWN.items():
        one = problem(found, Scene(), friction=friction, place=somewhere)
        sigma[name] = [one.sigma(chosen) for chosen in place(one, 3)]
    assert sigma == {name: pytest.approx(values, rel=1e-5) for name, values in PLACED.items()}


def test_defaults_of_a_study():
    """What a study file leaves out, pinned."""
    scene, tolerances = vars(Scene()), vars(Tolerances())
    scene = {name: value for name, value in scene.items() if name not in ("unknown", "tolerances")}
    assert scene == {
        "force_N": (0.2, 0.98), "modulus_MPa": (0.05, 0.72), "forces": 3, "moduli": 5, "over": "worst", "samples": 100,
        "gauge_noise_microstrain": 5.0, "force_noise_N": 0.005, "depth_noise_mm": 0.005, "depth_zero_mm": 0.02,
        "depth_mm": 0.5, "place_mm": 1.0,
    }  # fmt: skip
    assert tolerances == {"gauge_mm": 0.3, "gauge_deg": 3.0, "thickness_mm": 0.2, "moduli": 0.3}
    assert Unknowns().friction == "unknown" and Unknowns().doubts.thickness_mm == 10.0
    assert vars(Sampler()) == {"kind": "sobol", "designs": 256, "geometries": 8, "seed": 0}
    assert (Limit().least, Limit().most) == (-np.inf, np.inf)
