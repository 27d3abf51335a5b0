"""Sliding compared with closed forms, its own symmetries, a second solver, and its balance of energy."""

from collections.abc import Iterator

import numpy as np

from papilla.fem import Motion, prepare_section, slide
from papilla.fem.sliding.coulomb import OPEN, Laws, relax, rub
from papilla.fem.sliding.reduced_section import ReducedSection
from papilla.finger import Finger
from papilla.specimen import Grating
from papilla.studies.case import Case
from papilla.studies.verify.bodies import off

COARSE_MM, LENGTH_MM, FORCE_N = 0.3, 5.0, 0.1
SHRINKING_MM = (1.0, 0.5, 0.25)
"""Sizes of the skin's elements."""
E_STAR, PERIOD, HEIGHT, SHARE = 0.1, 1.8, 0.02, 0.4


def depth_of_a_hump(section: ReducedSection) -> float:
    """Mean depth (mm) under a smooth hump of pressure, cos^2 over 8 mm, of 1 N/mm."""
    n, hump = len(section.x), np.where(np.abs(section.x) < 4, np.cos(np.pi * section.x / 8) ** 2, 0.0)
    load = hump * section.hats.sum(axis=1)
    load /= load.sum()
    return float(load @ section.compliance[n:, n:] @ load)


def sliding() -> Iterator[Case]:
    """A wavy indenter, and the default finger's section over gratings."""
    yield _westergaard()
    finger = Finger.default()
    depths = [depth_of_a_hump(prepare_section(finger, size_mm=size, ridges=False)) for size in SHRINKING_MM]
    coarse, fine = np.abs(np.diff(depths))
    order = float(np.log2(coarse / fine))
    yield Case("refinement in space", "order of the depth under a smooth pressure, against 2", off(order, 2.0), 0.2)
    yield Case("element size", "change of that depth from 0.5 to 0.25 mm", float(fine / depths[-1]), 0.005)
    section = prepare_section(finger, size_mm=COARSE_MM)

    def slid(speed: float, path: float, friction: float, dynamics: str):
        return slide(
            finger, Grating(0.9, 0.9, 0.3), Motion.steady(speed, path / abs(speed)), force=FORCE_N, friction=friction,
            dynamics=dynamics, section=section, length_mm=LENGTH_MM,
        )  # fmt: skip

    there, back = (slid(way * 36.0, 9.0, 0.5, "quasi-static") for way in (1, -1))
    ratio = there.tangential_N[there.sliding] / there.force_N[there.sliding]
    yield Case(
        "full slip", "net tangential over net normal force, against mu", float(np.abs(ratio / 0.5 - 1).max()), 1e-9
    )
    scale = np.abs(there.readings).max()
    mirrored = float(np.abs(back.readings[:, ::-1] - there.readings).max() / scale)
    yield Case("reversed motion", "readings mirrored, over the largest", mirrored, 1e-6)
    later = np.abs(there.readings[-50:] - there.readings[-100:-50]).max() / np.ptp(there.readings[-50:], axis=0).max()
    yield Case("a period further", "readings repeated, over their swing", float(later), 0.01)
    n = len(section.x)
    laws = Laws(
        section.compliance, section.z.max() - section.z, np.zeros(n), 0.02, 0.5, np.zeros(2 * n), depth=0.2
    )  # fmt: skip
    newton, relaxed = rub(laws, np.zeros(n, dtype=int)), relax(laws)
    differ = float(np.abs(newton.force - relaxed.force).max() / np.abs(relaxed.force).max())
    yield Case("two solvers", "forces by active sets against relaxation, stick and slip", differ, 1e-5)
    fast = slid(120.0, 12.0, 0.3, "modal")
    yield Case("energy", "work, less energy and loss, over work turned over", fast.energy_error, 0.01)


def _westergaard() -> Case:
    """Mean pressure p = pi E* a/L sin^2(pi s/2) closes the share s of waves of amplitude a and length L."""
    n = 256
    q = 2 * np.pi * np.abs(np.fft.fftfreq(n, PERIOD / n))
    kernel = np.fft.ifft(np.divide(2.0, E_STAR * q, out=np.zeros(n), where=q > 0)).real / (PERIOD / n)
    C = kernel[np.subtract.outer(np.arange(n), np.arange(n)) % n] + 1.0
    load = np.pi * E_STAR * HEIGHT * np.sin(np.pi * SHARE / 2) ** 2
    rise = HEIGHT * (1 - np.cos(2 * np.pi * np.arange(n) / n))
    none = np.zeros_like(C)
    laws = Laws(np.block([[C, none], [none, C]]), rise, np.zeros(n), 0.0, 0.0, np.zeros(2 * n), load=load)
    share = float((rub(laws, np.zeros(n, dtype=int)).state != OPEN).mean())
    return Case("sinusoidal indenter", "share in contact, against Westergaard", off(share, SHARE), 0.02)
