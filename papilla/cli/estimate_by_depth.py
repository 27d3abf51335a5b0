"""`papilla estimate --softness force-depth`: the modulus from force and depth, instead of from the gauges."""

from pathlib import Path
from typing import TYPE_CHECKING

from papilla.errors import InputError

if TYPE_CHECKING:
    import numpy as np

    from papilla.estimators import Pipeline, PipelineEstimate
    from papilla.logs import TimeLogFile

SWEEP = "sweep.csv"
"""Name of the table of presses in the folder of a calibration, which contains their depths."""


class DepthModulus:
    """Fills the columns of the modulus, and tells the pipeline, which does not compute them, that they exist.

    calibration : its file, with `SWEEP` in the same folder. Raises `InputError` without a calibration, and for a log
    without a force.
    """

    def __init__(self, calibration: Path | None, recorded: "TimeLogFile", pipeline: "Pipeline"):
        from papilla.estimators.published.force_depth import DepthErrors, ForceDepth
        from papilla.logs import read_presses

        if calibration is None or "force_N" not in recorded.optional:
            raise InputError(f"--softness force-depth needs --calibration with its {SWEEP}, and force_N in the log")
        sweep = read_presses(calibration.with_name(SWEEP))
        if sweep.indentation_mm is None:
            raise InputError(f"{calibration.with_name(SWEEP)} has no column indentation_mm")
        self._model = ForceDepth(sweep.force_N, sweep.modulus_MPa, sweep.indentation_mm)
        floor = DepthErrors()
        self._errors = DepthErrors(
            depth_mm=max(recorded.noise["indentation_mm"], floor.depth_mm),
            force_N=max(recorded.noise["force_N"], floor.force_N),
        )
        names = ("t_s", *recorded.gauge_names, *recorded.optional)
        self._force, self._depth = names.index("force_N"), names.index("indentation_mm")
        self._legend = pipeline.legend["modulus"]
        del pipeline.off["modulus"]

    def added(self, block: "np.ndarray", answer: "PipelineEstimate") -> "PipelineEstimate":
        """The answers (n, columns) with the modulus of each row."""
        modulus, sigma, found = self._model.process(block[:, self._force], block[:, self._depth], self._errors)
        self._legend.pop("", None)
        self._legend.update({status.code: status.sentence for status in {*found}})
        codes = [status.code for status in found]
        return answer._replace(modulus_MPa=modulus, modulus_sigma_MPa=sigma, modulus_status=codes)
