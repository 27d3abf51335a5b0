"""Signals of the sliding section (`papilla.fem.slide`) over surfaces, as the finger of the papers reads them.

They contain harmonics, beats with the ridges, effects of the contact's edges and the section's own oscillation. Only
the middle gauge of the default finger is used; its AC power is 1, as in every scene.
"""

import math

import numpy as np

from papilla.fem import Motion, slide
from papilla.finger import Finger
from papilla.specimen import Grating
from papilla.studies.estimator_bench.scene_parts import Draft
from papilla.textures import MeasuredProfile, Texture

FORCE_N, LENGTH_MM, FRICTION, DEPTH_MM = 0.3, 7.0, 0.3, 0.5
"""Pressing force; length that gives the line load in the contact's middle; friction; depth of the grooves."""

EDGE_MM, STEP_MM, BESIDE_MM = 9.0, 0.05, 15.0
"""Mean distance of edges on a surface without a period, spacing of its points, and extra length beyond the path."""


def felt_grating(draft: Draft) -> None:
    """A grating of the requested wavelength, groove = ridge."""
    half = draft.asked_mm / 2
    draft.wavelength = draft.everywhere(draft.asked_mm)
    _feel(draft, Grating(half, half, DEPTH_MM))


def felt_edges(draft: Draft) -> None:
    """Single steps up and down at random places: there is no line, but one ridge after the other feels every step."""
    low, high = draft.skin.min() - BESIDE_MM, draft.skin.max() + BESIDE_MM
    x = np.arange(low, high, STEP_MM)
    steps = np.cumsum(draft.rng.exponential(EDGE_MM, size=math.ceil(4 * (high - low) / EDGE_MM) + 9))
    draft.wavelength = draft.everywhere(math.nan)
    _feel(draft, MeasuredProfile(x, 0.2 * (np.searchsorted(steps, x - low) % 2)))


def _feel(draft: Draft, texture: Texture) -> None:
    finger = Finger.default()
    motion = Motion(draft.time_s, draft.skin, draft.rate_Hz)
    found = slide(finger, texture, motion, force=FORCE_N, friction=FRICTION, length_mm=LENGTH_MM)
    middle = found.amplified[:, [len(finger.gauges) // 2]]
    varied = middle - middle.mean(axis=0)
    draft.texture = np.repeat(varied / varied.std(), len(draft.offsets_mm), axis=1)
