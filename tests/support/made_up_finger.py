"""A finger whose presses, slides and models are made up: functions of the same arguments, in closed form.

They stand in for finite elements where a test is about what is done with the results.
"""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from papilla import fem
from papilla.calibration import Sweep
from papilla.model.finger import Finger

PATTERN = np.array([-0.3, 0.5, 1.0, 0.4, -0.2])
STIFF_MPA, RADIUS_MM = 0.1, 10.0


def patch():
    """Nine nodes of a quarter of a patch."""
    x, y = (axis.ravel() for axis in np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0, 2.0]))
    images = np.array([(1, 1), (-1, 1), (1, -1), (-1, -1)])
    triangles = np.array([(0, 1, 3), (1, 4, 3)])
    gap = (x**2 + y**2) / 20
    return SimpleNamespace(
        xy=np.column_stack([x, y]), mass=1 + 0.1 * np.arange(9), gap=gap, finest_edge=0.7, images=images,
        triangles=triangles,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class MadeUp:
    """In place of `papilla.fem.ReducedFinger`; `stiff` says how much stiffer than the default finger it is."""

    finger: Any
    at: tuple[float, float] = (0.0, 0.0)
    stiff: float = 1.0
    weights: np.ndarray = field(default_factory=lambda: np.ones((2, 5)))
    patch: Any = field(default_factory=patch)
    multiplicity: int = 4
    mesh_size_mm: float = 1.4
    finger_sha256: str = "finger"
    mesh_sha256: str = "mesh"

    @property
    def bench(self):
        """Of the default finger."""
        return Finger.default().bench

    @property
    def gauge_names(self):
        """Five."""
        return tuple(f"g{k + 1}" for k in range(5))

    @property
    def gains(self):
        """Of five gauges."""
        return 1 + 0.1 * np.arange(5)

    @property
    def compliance(self):
        """Of nine nodes."""
        far = np.linalg.norm(self.patch.xy[:, None] - self.patch.xy, axis=2)
        return 1 / (1 + far) / self.stiff

    @property
    def strain_rows(self):
        """(5, nodes)."""
        return PATTERN[:, None] * (1 + np.arange(9))

    def specimen_compliance(self, specimen):
        """Of nine nodes."""
        return self.compliance * self.stiff / specimen.modulus


def prepare(finger=None, *, variant=0, at=(0.0, 0.0), size_mm=1.4, **_):
    """`papilla.fem.prepare`: another mesh is 1 % stiffer, a place beside the apex 2 % a mm."""
    finger = finger or Finger.default()
    default = Finger.default()
    ratio = (finger.outer.modulus + 2 * finger.inner.modulus) / (default.outer.modulus + 2 * default.inner.modulus)
    stiff = ratio * (1 + 0.01 * variant) * (1 + 0.02 * float(np.hypot(*at))) * (1 + 0.01 * (size_mm - 1.4))
    return MadeUp(finger, at=tuple(at), stiff=stiff, mesh_size_mm=size_mm)


def press(reduced, specimen, *, force=None, indentation=None, fidelity="contact", friction=0.0, **_):
    """`papilla.fem.press`: Hertz on two bodies in a row, and gauges that follow a power of the force."""
    number = friction if isinstance(friction, float | int) else np.inf
    modulus = specimen.modulus * (1 + 0.3 / getattr(specimen, "thickness", 100.0))
    finger = STIFF_MPA * reduced.stiff * (1 + 0.02 * min(number, 1.0))
    both = 4 / 3 * modulus * finger / (modulus + finger) * np.sqrt(RADIUS_MM)
    both *= {"hertz": 1.01, "finite": 1.03}.get(fidelity, 1.0)
    force = both * max(indentation, 0.0) ** 1.5 if force is None else float(force)
    depth = (force / both) ** (2 / 3)
    area = np.pi * RADIUS_MM * depth + 0.01
    soft = modulus / (modulus + finger)
    strain = 0.01 * force**0.6 * soft * (PATTERN + 0.02 * reduced.weights[1, 0] * np.arange(5)) / reduced.stiff
    nodes = len(reduced.patch.xy)
    pressure = force * np.maximum(1 - (reduced.patch.xy**2).sum(axis=1) / 6, 0) - 1e-9 * force
    shear = np.outer([1.0, 0.1 * min(number, 1.0), 0.05], np.arange(nodes)) * force
    return SimpleNamespace(
        force=force, modulus=specimen.modulus, fidelity=fidelity or "contact", friction=number, indentation=depth,
        contact_area=area, peak_pressure=1.5 * force / area, strain=strain, reading=1e6 * strain,
        sd=float(1e6 * strain.std()), finger_indentation=soft * depth, specimen_indentation=(1 - soft) * depth,
        finger_share=soft, resolved=force < 0.9, status="made up", pressure=pressure, force_balance=1e-12 * force,
        traction=shear, seconds=0.1, large_strain=fidelity == "finite",
    )  # fmt: skip


def sweep(reduced, moduli, forces, block, friction=0.0, steps=None):
    """`papilla.calibration.fitting.job.cached_sweep` by `press`."""
    pairs = [(modulus, force) for modulus in moduli for force in forces]
    made = block if callable(block) else lambda modulus: replace(block, modulus=modulus)
    found = [press(reduced, made(float(modulus)), force=force, friction=friction) for modulus, force in pairs]
    modulus, force = np.array(pairs).T
    return Sweep(
        force_N=force, modulus_MPa=modulus, reading=np.array([one.reading for one in found]),
        sd_microstrain=np.array([one.sd for one in found]), indentation_mm=np.array([one.indentation for one in found]),
        contact_area_mm2=np.array([one.contact_area for one in found]),
        peak_pressure_MPa=np.array([one.peak_pressure for one in found]), resolved=np.ones(len(force), bool),
        status=("made up",) * len(force), gauge_names=reduced.gauge_names, specimen="Block(thickness=10.0, nu=0.495)",
        finger_name="made up", finger_sha256="0" * 64, mesh_sha256="1" * 64, mesh_size_mm=1.4,
    )  # fmt: skip


def instead_of_fem(patch) -> None:
    """`papilla.fem.prepare` and `press` are made up."""
    patch.setattr(fem, "prepare", prepare)
    patch.setattr(fem, "press", press)
