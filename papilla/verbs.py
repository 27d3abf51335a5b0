"""The three jobs as functions: press a finger, calibrate a finger, identify a finger from presses."""

import warnings
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

from papilla.core.progress import Progress, silent

if TYPE_CHECKING:
    from papilla.calibration.fitting.job import Calibrated
    from papilla.fem.pressing.press import Press
    from papilla.fem.reduction.reduced import ReducedFinger
    from papilla.identification.fit import Identification
    from papilla.identification.noise import PressNoise
    from papilla.logs import PressLog
    from papilla.model.finger import Finger
    from papilla.model.specimen import Friction, Specimen


def press(
    finger: "Finger | ReducedFinger",
    specimen: "Specimen",
    *,
    force: float | None = None,
    indentation: float | None = None,
    fidelity: str | None = None,
    tolerance: float = 0.02,
    friction: "Friction | None" = None,
) -> "Press":
    """Press a specimen on a finger by a force (N) or an indentation (mm): `papilla.fem.press`.

    finger : a design, whose condensed model comes from the cache or is made, or what `papilla.fem.prepare` made of one.
    """
    from papilla import fem
    from papilla.model.finger import Finger

    reduced = fem.prepare(finger) if isinstance(finger, Finger) else finger
    how: Any = {"fidelity": fidelity, "tolerance": tolerance, "friction": friction}
    return fem.press(reduced, specimen, force=force, indentation=indentation, **how)


def identify(
    log: "PressLog",
    finger: "Finger | None" = None,
    *,
    free: Sequence[str] = (),
    fix: Mapping[str, float] | None = None,
    specimen: "Specimen | None" = None,
    noise: "PressNoise | None" = None,
    friction: "Friction | None" = None,
    size_mm: float | None = None,
    processes: int = 1,
    progress: Progress = silent,
) -> "Identification":
    """Identify a finger of known geometry from presses on specimens of known modulus, as `identification.identify`.

    finger : the design, whose geometry is known; None takes the default finger.
    """
    from papilla import identification
    from papilla.model.finger import Finger

    how: Any = {"specimen": specimen, "noise": noise, "friction": friction, "size_mm": size_mm}
    how |= {"processes": processes, "progress": progress}
    return identification.identify(log, finger or Finger.default(), free=free, fix=fix, **how)


OLD_NAMES = {
    "papilla.calibration": (
        "Calibrated", "Check", "DEFAULT_FORCES", "DEFAULT_MODULI", "Sweep", "c_header", "calibrate_finger", "check",
        "fit", "sweep", "with_positions",
    ),
    "papilla.identification": (
        "Identification", "IndentationModulus", "MaterialTests", "Relaxation", "Suggestion", "fit_indentation",
        "fit_material", "fit_relaxation", "identify", "suggest_presses",
    ),
}  # fmt: skip
"""Where the names of the package `papilla.calibrate` of 0.2 are now."""


class Calibrate:
    """Calibrate a finger: mesh, model, sweep over forces (N) and moduli (MPa), fit and checks, as
    `papilla.calibration.calibrate_finger`.

    The intervals of an identified finger contain the uncertainty of its identification. Through 0.3 the names of the
    package `papilla.calibrate` of 0.2 are attributes, with a warning.
    """

    def __call__(
        self,
        finger: "Finger",
        *,
        friction: "Friction | None" = None,
        size_mm: float | None = None,
        quick: bool = False,
        forces: Sequence[float] | None = None,
        moduli: Sequence[float] | None = None,
        processes: int = 1,
        progress: Progress = silent,
    ) -> "Calibrated":
        """Calibrate a finger."""
        from papilla.identification.bench import calibrate

        stated = {"forces": forces, "moduli": moduli}
        how: Any = {name: values for name, values in stated.items() if values is not None}
        how |= {"friction": friction, "size_mm": size_mm, "quick": quick, "processes": processes}
        return calibrate(finger, progress=progress, **how)

    def __getattr__(self, name: str) -> Any:
        for place, names in OLD_NAMES.items():
            if name in names:
                message = f"papilla.calibrate.{name} is {place}.{name} now; the old name goes with 0.4"
                warnings.warn(message, DeprecationWarning, stacklevel=2)
                return getattr(import_module(place), name)
        raise AttributeError(f"papilla.calibrate has no attribute {name!r}")


calibrate = Calibrate()
