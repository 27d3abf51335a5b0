"""A finger with all lengths and moduli times a factor, and what a status says apart from lengths."""

import dataclasses
import re

import numpy as np

from papilla.fem.reduction.family import with_moduli


def scaled_finger(finger, length, stress):
    """The finger with all lengths and moduli times a factor."""

    def longer(owner, *names):
        sizes = {name: np.multiply(length, getattr(owner, name)).tolist() for name in names}
        return dataclasses.replace(owner, **{k: tuple(v) if isinstance(v, list) else v for k, v in sizes.items()})

    body = [name for name in ("outer", "interface", "bone", "depth") if hasattr(finger.shape, name)]
    gauges = tuple(longer(gauge, "y_mm", "length_mm", "width_mm", "backing_mm") for gauge in finger.gauges)
    stated = ["patch_radius"] if finger.patch_radius is not None else []
    bench = longer(finger.bench, "thickness", "touch_down")
    larger = dataclasses.replace(longer(finger, *stated), shape=longer(finger.shape, *body), gauges=gauges, bench=bench)
    return with_moduli(larger, stress * finger.outer.modulus, stress * finger.inner.modulus)


def without_lengths(status):
    """A status with all lengths replaced by one word."""
    return re.sub(r"[\d.e+-]+ mm|size_mm <= [\d.e+-]+", "LENGTH", status)
