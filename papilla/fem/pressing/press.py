"""`Press`: what one press of a specimen on a finger gives, whichever rung computed it."""

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from papilla.fem.reduction.reduced import ReducedFinger
from papilla.specimen import Specimen
from papilla.units import to_microstrain


@dataclass(frozen=True, eq=False)
class Press:
    """Result of one scene; n patch nodes, g gauges.

    force (N), indentation (mm, approach of specimen and finger), contact_area (mm2), peak_pressure (MPa).
    strain (g,), curvature (g,) in 1/mm, reading (g,) in microstrain.
    sd : population standard deviation (ddof 0) of the readings, in microstrain.
    force_balance : relative difference of the pressure's integral from the force.
    pressure (n,) in MPa at the patch nodes; active (n,) nodes in contact.
    resolved : whether the mesh is fine enough for this contact.
    status : what happened, in a sentence.
    """

    force: float
    modulus: float
    fidelity: str
    indentation: float
    contact_area: float
    peak_pressure: float
    strain: np.ndarray
    curvature: np.ndarray
    reading: np.ndarray
    sd: float
    force_balance: float
    status: str
    resolved: bool
    seconds: float
    pressure: np.ndarray
    active: np.ndarray

    def to_json(self) -> dict:
        """The documented keys of a press, as plain values."""
        return {
            "force_N": self.force,
            "modulus_MPa": self.modulus,
            "fidelity": self.fidelity,
            "indentation_mm": self.indentation,
            "contact_area_mm2": self.contact_area,
            "peak_pressure_MPa": self.peak_pressure,
            "gauge_strain": self.strain.tolist(),
            "reading_microstrain": self.reading.tolist(),
            "sd_microstrain": self.sd,
            "force_balance": self.force_balance,
            "status": self.status,
            "seconds": self.seconds,
        }


def press_result(
    reduced: ReducedFinger, specimen: Specimen, began: float, *, strain: np.ndarray, curvature: np.ndarray, **values
) -> Press:
    """A `Press` from strain and curvature (g,) and its other values; `began` is when its clock started."""
    reading = to_microstrain(reduced.gains * strain + reduced.levers * curvature)
    return Press(
        modulus=specimen.modulus,
        strain=strain,
        curvature=curvature,
        reading=reading,
        sd=float(reading.std()),
        seconds=perf_counter() - began,
        **values,
    )
