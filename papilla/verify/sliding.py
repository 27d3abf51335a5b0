"""Sliding compared with closed forms, its own symmetries, a second solver, and its balance of energy."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from papilla.core import settings
from papilla.fem import Motion, prepare_section, slide
from papilla.fem.sliding.coulomb import OPEN_NODE, Laws, relax, rub
from papilla.fem.sliding.section import ReducedSection
from papilla.model.finger import Finger
from papilla.model.specimen import Grating
from papilla.verify.bodies import apart, off
from papilla.verify.case import Case

SLIDE_CASES = settings.parameters(__name__)


def depth_of_a_hump(section: ReducedSection) -> float:
    """Mean depth (mm) under a smooth hump of pressure, cos^2 over `hump_mm`, of 1 N/mm."""
    n, width = len(section.x), SLIDE_CASES.hump_mm
    hump = np.where(np.abs(section.x) < width / 2, np.cos(np.pi * section.x / width) ** 2, 0.0)
    load = hump * section.hats.sum(axis=1)
    load /= load.sum()
    return float(load @ section.compliance[n:, n:] @ load)


def sliding() -> Iterator[Case]:
    """A wavy indenter, and the default finger's section over gratings."""
    yield _westergaard()
    finger = Finger.default()
    smooth = replace(finger, ridges=None)
    depths = [depth_of_a_hump(prepare_section(smooth, size_mm=size)) for size in SLIDE_CASES.shrinking_mm]
    coarse, fine = np.abs(np.diff(depths))
    order = float(np.log2(coarse / fine))
    measure = "order of the depth under a smooth pressure, against 2"
    yield Case("refinement in space", measure, off(order, 2.0), SLIDE_CASES.order_bound)
    yield Case(
        "element size", "change of that depth from 0.5 to 0.25 mm", float(fine / depths[-1]), SLIDE_CASES.size_bound
    )
    section = prepare_section(finger, size_mm=SLIDE_CASES.coarse_mm)

    def slid(speed: float, path: float, friction: float, dynamics: str):
        return slide(
            finger, Grating(*SLIDE_CASES.grating_mm), Motion.steady(speed, path / abs(speed)),
            force=SLIDE_CASES.force_N,
            friction=friction, dynamics=dynamics, section=section, length_mm=SLIDE_CASES.length_mm,
        )  # fmt: skip

    forward, back = (
        slid(way * SLIDE_CASES.speed_mm_s, SLIDE_CASES.path_mm, SLIDE_CASES.friction, "quasi-static") for way in (1, -1)
    )
    ratio = forward.tangential_N[forward.sliding] / forward.force_N[forward.sliding]
    away = float(np.abs(ratio / SLIDE_CASES.friction - 1).max())
    yield Case("full slip", "net tangential over net normal force, against mu", away, SLIDE_CASES.slip_bound)
    mirrored = apart(back.readings[:, ::-1], forward.readings)
    yield Case("reversed motion", "readings mirrored, over the largest", mirrored, SLIDE_CASES.mirror_bound)
    before, last = np.split(forward.readings[-2 * SLIDE_CASES.period_samples :], 2)
    later = np.abs(last - before).max() / np.ptp(last, axis=0).max()
    yield Case("a period further", "readings repeated, over their swing", float(later), SLIDE_CASES.period_bound)
    n, parameters = len(section.x), SLIDE_CASES.solvers
    laws = Laws(
        section.compliance, section.z.max() - section.z, np.zeros(n), parameters.drift_mm, parameters.friction,
        np.zeros(2 * n), depth=parameters.depth_mm,
    )  # fmt: skip
    differ = apart(rub(laws, np.zeros(n, dtype=int)).force, relax(laws).force)
    yield Case("two solvers", "forces by active sets against relaxation, stick and slip", differ, parameters.bound)
    parameters = SLIDE_CASES.fast
    fast = slid(parameters.speed_mm_s, parameters.path_mm, parameters.friction, "modal")
    yield Case("energy", "work, less energy and loss, over work turned over", fast.energy_error, parameters.bound)


def _westergaard() -> Case:
    """Mean pressure p = pi E* a/L sin^2(pi s/2) closes the share s of waves of amplitude a and length L."""
    waves = SLIDE_CASES.waves
    n, period, e_star, height = waves.points, waves.period_mm, waves.e_star_MPa, waves.height_mm
    q = 2 * np.pi * np.abs(np.fft.fftfreq(n, period / n))
    kernel = np.fft.ifft(np.divide(2.0, e_star * q, out=np.zeros(n), where=q > 0)).real / (period / n)
    C = kernel[np.subtract.outer(np.arange(n), np.arange(n)) % n] + 1.0
    load = np.pi * e_star * height * np.sin(np.pi * waves.share / 2) ** 2
    rise = height * (1 - np.cos(2 * np.pi * np.arange(n) / n))
    none = np.zeros_like(C)
    laws = Laws(np.block([[C, none], [none, C]]), rise, np.zeros(n), 0.0, 0.0, np.zeros(2 * n), load=load)
    share = float((rub(laws, np.zeros(n, dtype=int)).state != OPEN_NODE).mean())
    return Case("sinusoidal indenter", "share in contact, against Westergaard", off(share, waves.share), waves.bound)
