"""The section in motion: slow modes with inertia and damping, all faster ones as static compliance.

Each mode q'' + 2 zeta w q' + w^2 q = phi . f is integrated exactly for forces that are linear over a step. So a step is
the same contact problem as at rest, with another compliance and with a displacement u_past from the earlier motion: u(t
+ dt) = u_past + (C_rest + phi G phi^T) f(t + dt), C_rest = C - phi w^-2 phi^T.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from papilla.fem.sliding.section import Modes
from papilla.model.parts import Identified
from papilla.references import Prony

LOSS_FACTOR = 0.1
"""Loss factor of silicone at 10 to 100 Hz, assumed: it varies between 0.05 and 0.3."""

LONGEST_RELAXATION_RATIO = 10.0
"""Ratio of a relaxation time to 1 / omega of a mode above which at most a tenth of its share contributes to the
loss."""


@dataclass(eq=False)
class AtRest:
    """A body without inertia: displacements are the compliance times the forces."""

    compliance: np.ndarray
    rows: np.ndarray

    def __post_init__(self) -> None:
        self._none = np.zeros(len(self.compliance))

    def free(self) -> np.ndarray:
        """Zero displacement: there is no effect of the past."""
        return self._none

    def accept(self, force: np.ndarray) -> None:
        """Does nothing: there is no state."""

    def readings(self, force: np.ndarray) -> np.ndarray:
        """Readings (g,) in microstrain."""
        loaded = np.flatnonzero(force)
        return self.rows[:, loaded] @ force[loaded]


def loss_factors(stated: float | None, identified: Identified | None, omega: np.ndarray) -> tuple[np.ndarray, str]:
    """Loss factors (k,) of modes (k,) in rad/s and their origin: stated, from a finger's identified Prony terms if
    these are fast enough for the modes, or `LOSS_FACTOR`."""
    if stated is not None:
        return np.full(len(omega), stated), "as stated"
    times = identified.relaxation_times_s if identified is not None else ()
    assumed, none = np.full(len(omega), LOSS_FACTOR), "assumed, as of silicone at 10 to 100 Hz"
    if identified is None or not times:
        return assumed, f"{none}: the finger has no identified relaxation"
    if (turns := min(times) * omega[0]) > LONGEST_RELAXATION_RATIO:
        return assumed, (
            f"{none}: the identified relaxation of {min(times):.3g} s is {turns:.0f} times slower than the first mode, "
            "and tells nothing of its loss"
        )
    return Prony(identified.relaxation_shares, times).loss_factor(omega), "of the finger's identified relaxation"


class Modal:
    """Modes with inertia; loss factors eta (k,) enter as damping ratios eta / 2. The motion starts at rest under a
    force.

    step : s. rows : (g, 2n) readings per force; mode_rows : (g, k) readings per unit of a mode.
    """

    def __init__(
        self, modes: Modes, compliance: np.ndarray, rows: np.ndarray, mode_rows: np.ndarray, step: float,
        loss: np.ndarray, force: np.ndarray,
    ):  # fmt: skip
        self._modes, self._patch = modes, modes.patch
        square = modes.omega**2
        # Faster modes follow at once: their static compliance is the whole one minus that of the kept modes.
        self._rest = compliance - (self._patch / square) @ self._patch.T
        self._rest_rows, self._mode_rows = rows - (mode_rows / square) @ self._patch.T, mode_rows
        # (q, q', f, slope of f) over one step
        generator = np.zeros((len(square), 4, 4))
        generator[:, 0, 1] = generator[:, 1, 2] = generator[:, 2, 3] = 1.0
        generator[:, 1, 0], generator[:, 1, 1] = -square, -loss * modes.omega
        propagator = expm(generator * step)
        # Exact step of each mode for a force that is linear over the step: q at the end from q, q', the force before
        # and the force after.
        self._own, by_force, by_slope = propagator[:, :2, :2], propagator[:, :2, 2], propagator[:, :2, 3] / step
        self._before, self._after = by_force - by_slope, by_slope
        self.compliance = self._rest + (self._patch * self._after[:, 0]) @ self._patch.T
        self._load = self._patch.T @ force
        self.state = np.stack([self._load / square, np.zeros_like(square)], axis=1)
        self._loss, self._step, self.lost = loss, step, 0.0
        self._coasted = self._coast()

    def _coast(self) -> np.ndarray:
        """State (k, 2) at the end of the step without forces there."""
        return np.einsum("kij,kj->ki", self._own, self.state) + self._before * self._load[:, None]

    def free(self) -> np.ndarray:
        """Displacements (2n,) at the end of the step without forces there."""
        return self._patch @ self._coasted[:, 0]

    def accept(self, force: np.ndarray) -> None:
        """End the step with forces (2n,)."""
        loaded = np.flatnonzero(force)
        load = self._patch[loaded].T @ force[loaded]
        before = self.state[:, 1]
        self.state, self._load = self._coasted + self._after * load[:, None], load
        self._coasted = self._coast()
        # Simpson's rule would need the middle of the step; the mean square of a linear velocity does not
        speeds = (before**2 + before * self.state[:, 1] + self.state[:, 1] ** 2) / 3
        self.lost += float(self._step * self._loss * self._modes.omega @ speeds)

    def readings(self, force: np.ndarray) -> np.ndarray:
        """Readings (g,) in microstrain."""
        loaded = np.flatnonzero(force)
        return self._rest_rows[:, loaded] @ force[loaded] + self._mode_rows @ self.state[:, 0]

    def energy(self, force: np.ndarray) -> float:
        """Elastic and kinetic energy in N mm per mm."""
        q, speed = self.state.T
        return float(force @ self._rest @ force + (speed**2).sum() + ((self._modes.omega * q) ** 2).sum()) / 2


Inertia = AtRest | Modal
"""A body in the time loop: its compliance at the end of a step, and the displacement by the earlier motion."""
