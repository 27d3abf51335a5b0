"""What a calibration holds, without what it can do: the form that files are read into and written from."""

from dataclasses import dataclass

from papilla.calibration.position import PositionTerms
from papilla.calibration.quadratic import Quadratic, QuadraticInverse
from papilla.calibration.readouts import GaugeSurface, SdSurface


@dataclass(frozen=True, eq=False)
class CalibrationData:
    """The fields of a calibration.

    Parameters
    ----------
    finger : {"name", "sha256"}; mesh : what the sweep was computed on (empty for a bench calibration).
    forward, inverse : the published quadratic form and its exact inverse (gf, MPa, microstrain).
    surface : ln S_d, used by `predict` and `invert`; gauges : one surface a gauge.
    provenance : versions, hashes, when; notes : what a user has to doubt, a sentence each.
    position : what contacts beside the apex change; None where it is not known.
    """

    finger: dict
    mesh: dict
    forward: Quadratic
    inverse: QuadraticInverse
    surface: SdSurface
    gauges: tuple[GaugeSurface, ...]
    provenance: dict
    notes: tuple[str, ...] = ()
    position: PositionTerms | None = None

    @property
    def domain(self) -> dict[str, tuple[float, float]]:
        """{"force_N", "modulus_MPa"}: the ranges that were calibrated."""
        return {"force_N": self.surface.surface.force_N, "modulus_MPa": self.surface.surface.modulus_MPa}
