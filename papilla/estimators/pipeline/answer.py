"""The answer of a pipeline: the documented columns of one sample, and a status that says in words why one is empty."""

from typing import Any, NamedTuple

import numpy as np


class PipelineEstimate(NamedTuple):
    """The columns of `papilla estimate`: NaN if there is no answer, and a status that says why.

    modulus_status, wavelength_status, friction_status : a short code for each quantity, which begins with "ok" if the
    value may be used; `Pipeline.legend` explains it. If only the frequency is known, wavelength_status is the code of
    the frequency. status : in words, "ok", or what is wrong with the time, the gauges and each estimator, then `no
    <output>: <why>` for each output that is switched off. Of a block, arrays (n,) and lists of n strings.
    """

    modulus_MPa: float | np.ndarray
    modulus_sigma_MPa: float | np.ndarray
    frequency_Hz: float | np.ndarray
    wavelength_mm: float | np.ndarray
    wavelength_sigma_mm: float | np.ndarray
    mu_kinetic: float | np.ndarray
    mu_kinetic_sigma: float | np.ndarray
    mu_static: float | np.ndarray
    mu_static_sigma: float | np.ndarray
    modulus_status: str | list[str]
    wavelength_status: str | list[str]
    friction_status: str | list[str]
    status: str | list[str]

    def __repr__(self) -> str:
        """One line per quantity; for a block, the last row and the number of rows."""
        rows, last = "", self
        if isinstance(self.status, list):
            if not self.status:
                return "PipelineEstimate(no rows)"
            rows = f"{len(self.status)} rows, the last: "
            columns: Any = self
            last = PipelineEstimate(*(column[-1] for column in columns))
        told = [
            f"modulus {last.modulus_MPa:.4g} ± {last.modulus_sigma_MPa:.2g} MPa: {last.modulus_status}",
            f"wavelength {last.wavelength_mm:.4g} ± {last.wavelength_sigma_mm:.2g} mm, {last.frequency_Hz:.4g} Hz: "
            f"{last.wavelength_status}",
            f"friction {last.mu_kinetic:.4g} kinetic, {last.mu_static:.4g} static: {last.friction_status}",
        ]
        return f"PipelineEstimate({rows}" + "\n  ".join(told) + ")"


QUANTITIES = ("modulus", "wavelength", "friction")
"""The quantities that have their own status, in the order of the columns."""
