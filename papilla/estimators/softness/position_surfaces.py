"""The gauges' surfaces with what contacts beside the apex change in them, ready for a control loop."""

import numpy as np

from papilla.calibration import Calibration
from papilla.errors import InputError
from papilla.estimators.softness.surfaces import GaugeSurfaces, Section

SCAN_FORCES, SCAN_PLACES = 12, 17
"""Forces and places of the table that a first sample is looked up in."""


class PositionSurfaces(GaugeSurfaces):
    """`GaugeSurfaces` of a calibration with contact positions; raises `InputError` where it has none."""

    def __init__(self, calibration: Calibration):
        terms, domain = calibration.position_terms, calibration.domain
        if (terms.force_N, terms.modulus_MPa) != (domain["force_N"], domain["modulus_MPa"]):
            raise InputError("softness.position of the calibration has another domain than its surfaces")
        self.reach = terms.reach_mm
        m, n, k = self.cells = terms.cells
        # (n, m, k, 16 g, 4): per cell, gauges and powers over force and x by powers over modulus.
        self._moved = np.ascontiguousarray(terms.polynomials.transpose(1, 0, 2, 3, 4, 6, 5)).reshape(n, m, k, -1, 4)
        self._place_errors = terms.error.T.tolist()
        self.starts = terms.force_axis.start, terms.modulus_axis.start, -terms.reach_mm
        self.rates = 1 / terms.force_axis.step, 1 / terms.modulus_axis.step, 1 / terms.step_mm
        self._readings = calibration.predict_readings
        super().__init__(calibration)
        self._moduli = np.clip(np.exp(self.nodes), *terms.modulus_MPa)

    def section(self, ln_modulus: float) -> "PositionSection":
        """The surfaces of all groups at one modulus of the domain, and what positions change there."""
        rate = self.rates[1]
        u = (ln_modulus - self.starts[1]) * rate
        j = min(max(int(u), 0), self.cells[1] - 1)
        u -= j
        powers = np.array([[1.0, 0.0], [u, rate], [u * u, 2 * u * rate], [u * u * u, 3 * u * u * rate]])
        return PositionSection(self, self._sections.at(ln_modulus), self._moved[j], powers)

    def place_errors(self, position: float) -> list[float]:
        """(g,) one sigma of each gauge's change at a position within reach, microstrain / N."""
        s = (position - self.starts[2]) * self.rates[2]
        c = min(max(int(s), 0), self.cells[2] - 1)
        s -= c
        return [
            low + s * (high - low) for low, high in zip(self._place_errors[c], self._place_errors[c + 1], strict=True)
        ]

    def scan(self, nodes: list[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(e, c, g) readings at e modulus nodes and c contacts; the forces (N) and the places (mm) of these, (c,)."""
        forces, moduli = np.geomspace(self.low_force, self.high_force, SCAN_FORCES), self._moduli[nodes]
        forces[[0, -1]] = self.low_force, self.high_force
        contacts = np.array(np.meshgrid(forces, np.linspace(-self.reach, self.reach, SCAN_PLACES))).reshape(2, -1)
        return self._readings(contacts[0], moduli[:, None], contacts[1]), *contacts


class PositionSection(Section):
    """`Section` whose gauges each change with the position too."""

    __slots__ = ("_changes", "_moved", "_moved_powers", "_surfaces")

    def __init__(self, surfaces: PositionSurfaces, plain: Section, moved: np.ndarray, powers: np.ndarray):
        super().__init__(plain.ln_modulus, plain._powers, plain._cells, plain._x0, plain._per_x)
        self._surfaces, self._moved, self._moved_powers = surfaces, moved, powers
        self._changes: dict[tuple[int, int], np.ndarray] = {}

    def rows(self, force: float, ln_force: float, position: float) -> tuple[int, list[tuple]]:
        """The force cell of a contact within domain and reach, and of each gauge there its reading, the reading's
        slopes in ln E, force and position, and its second derivatives (force twice, force and position, position
        twice)."""
        surfaces = self._surfaces
        (x0, _, p0), (per_x, _, per_p), (m, _, k) = surfaces.starts, surfaces.rates, surfaces.cells
        t, s = (ln_force - x0) * per_x, (position - p0) * per_p
        i, c = min(max(int(t), 0), m - 1), min(max(int(s), 0), k - 1)
        t, s = t - i, s - c
        over_force = np.array([
            [1.0, t, t * t, t * t * t],
            [0.0, per_x, 2 * per_x * t, 3 * per_x * t * t],
            [0.0, 0.0, 2 * per_x * per_x, 6 * per_x * per_x * t],
        ])  # fmt: skip
        over_place = np.array([
            [1.0, 0.0, 0.0],
            [s, per_p, 0.0],
            [s * s, 2 * per_p * s, 2 * per_p * per_p],
            [s * s * s, 3 * per_p * s * s, 6 * per_p * per_p * s],
        ])  # fmt: skip
        changes = self._changes.get((i, c))
        values, slopes = (over_force @ (self._cut_at(i, c) if changes is None else changes) @ over_place).tolist()
        cell, points = self.evaluate(ln_force)
        rows = []
        for group, ((d, dx, dxx), (dl, dlx, _), (dll, _, _)), (along, _, _) in zip(
            surfaces.groups, values, slopes, strict=True
        ):
            q, a, slope, bend = points[group]
            slope += dl
            own = (force * (q + d), force * (a + along[0]), q + d + slope, force * dx)
            rows.append((*own, (slope + bend + dll) / force, dx + dlx, force * dxx))
        return cell, rows

    def _cut_at(self, i: int, c: int) -> np.ndarray:
        """(2, g, 4, 4) change and its slope in ln E, as powers over force and position."""
        gauges = self._surfaces.gauges
        cut = (self._moved[i, c] @ self._moved_powers).T.reshape(2, gauges, 4, 4)
        self._changes[i, c] = cut = np.ascontiguousarray(cut)
        return cut
