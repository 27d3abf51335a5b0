"""The gauges' calibrated surfaces, ready for a control loop: readings and slopes at a point, force from readings.

The modulus hardly moves from sample to sample, the force does: what is kept ready is a section at one modulus.
"""

import math
from itertools import combinations

import numpy as np

from papilla.calibration import Calibration
from papilla.calibration.surface import Curve, Surface
from papilla.errors import InputError

LEVELS = 128
"""Levels of ln |readings| in a table of the force."""
FORCES_PER_CELL = 4
LEAST_RISE = 1e-6
"""Of ln S_d from force to force, so that a level has one force."""
REACH, MOST_REACH = 0.5, 0.1
"""Samples are linearised anew when ln E has moved by so much of its sigma, or by so much: the truth is a sigma away
from the best place anyway."""
SAME = 1e-6
"""Relative difference up to which two surfaces count as one: gauges that mirror each other share their errors."""


class GaugeSurfaces:
    """Evaluates all gauges of a calibration, one surface for each group of gauges that share it.

    Raises `InputError` where the surfaces are cut differently.
    """

    def __init__(self, calibration: Calibration):
        surfaces = [gauge.surface for gauge in calibration.gauges]
        first = surfaces[0]
        for gauge in calibration.gauges[1:]:
            other = gauge.surface
            if (other.force_N, other.modulus_MPa, other.cells) != (first.force_N, first.modulus_MPa, first.cells):
                raise InputError(
                    f"the surface of {gauge.name} has another domain or other cells than the first gauge's"
                )
        self.gauges = len(surfaces)
        self.low_force, self.high_force = first.force_N
        force, modulus = first.force_axis, first.modulus_axis
        self._x0, self._per_x, self._m = force.start, 1 / force.step, force.cells
        self._y0, self._per_y, self._n = modulus.start, 1 / modulus.step, modulus.cells
        self.nodes = [modulus.start + modulus.step * node for node in range(modulus.cells + 1)]
        self.groups = _groups(surfaces)
        self.members = [
            [number for number, own in enumerate(self.groups) if own == group] for group in range(max(self.groups) + 1)
        ]
        self._sections = Sections([surfaces[numbers[0]] for numbers in self.members])
        self.errors = [self._cell_errors(calibration, cell) for cell in range(self._m)]
        self._norms, self._ln_forces = self._squares(surfaces)
        self._force_tables: dict[tuple[bool, ...], ForceTable | None] = {}
        # A table takes longer than an update may: those without up to three gauges are made at once.
        for left_out in range(min(4, self.gauges)):
            for missing in combinations(range(self.gauges), left_out):
                self.force_table(tuple(number not in missing for number in range(self.gauges)))

    def section(self, ln_modulus: float) -> "Section":
        """The surfaces of all groups at one modulus of the domain."""
        return self._sections.at(ln_modulus)

    def at_nodes(self, every: int) -> tuple[list[int], list["Section"]]:
        """Every so many modulus nodes and the last one: their numbers, and the surfaces there, ready in all cells."""
        numbers = [*range(0, self._n, every), self._n]
        sections = [self.section(self.nodes[number]) for number in numbers]
        for section in sections:
            section.cut_all()
        return numbers, sections

    def readings(self, force: float, ln_modulus: float) -> list[float]:
        """(g,) readings in microstrain at a point of the domain."""
        found = self.section(ln_modulus).evaluate(math.log(force))[1]
        return [force * found[group][0] for group in self.groups]

    def beyond(self, ln_modulus: float) -> float:
        """How far ln E lies outside the calibrated moduli."""
        return max(ln_modulus - self.nodes[-1], self.nodes[0] - ln_modulus, 0.0)

    def force_cell(self, ln_force: float) -> int:
        """Number of the force cell of a point of the domain."""
        return min(max(int((ln_force - self._x0) * self._per_x), 0), self._m - 1)

    def clamped(self, force: float) -> float:
        """The nearest calibrated force, to linearise at."""
        return min(max(force, self.low_force), self.high_force)

    def force_table(self, used: tuple[bool, ...]) -> "ForceTable | None":
        """Force from the norm of the used readings, or None where that norm does not rise with the force."""
        try:
            return self._force_tables[used]
        except KeyError:
            norms = 0.5 * np.log(np.maximum(self._norms[list(used)].sum(axis=0), 1e-300))
            rises = (np.diff(norms, axis=1) > 0).all()
            table = _force_table(norms, self._ln_forces, self._y0, self._per_y) if rises else None
            self._force_tables[used] = table
            return table

    def _squares(self, surfaces) -> tuple[np.ndarray, np.ndarray]:
        """(g, n + 1, k) squared readings over the modulus nodes and k forces, and ln force (k,)."""
        forces, moduli = _grid(surfaces[0])
        readings = [forces * surface(forces, moduli[:, None]) for surface in surfaces]
        return np.square(readings), np.log(forces)

    def _cell_errors(self, calibration: Calibration, cell: int) -> list[float]:
        """One sigma of each group's calibration (fit and mesh scatter, RMS over its gauges), microstrain / N, in a cell
        of force."""
        middle = math.exp(self._x0 + (cell + 0.5) / self._per_x)
        known = [gauge.uncertainty for gauge in calibration.gauges]
        squares = [own.fit_rms**2 + own.scatter_at(middle) ** 2 for own in known]
        return [math.sqrt(sum(squares[number] for number in own) / len(own)) for own in self.members]


class Sections:
    """Cuts s surfaces that share their cells at a modulus."""

    def __init__(self, surfaces: list[Surface]):
        force, modulus = surfaces[0].force_axis, surfaces[0].modulus_axis
        self._x0, self._per_x = force.start, 1 / force.step
        self._y0, self._per_y, self._n = modulus.start, 1 / modulus.step, modulus.cells
        # (m, n, 4, s, 4): powers of the place over force, surfaces, powers of the place over modulus.
        polynomials = np.stack([surface.polynomials for surface in surfaces], axis=3)
        self._columns = [
            [np.ascontiguousarray(row[j].swapaxes(0, 1).reshape(-1, 4)) for row in polynomials] for j in range(self._n)
        ]

    def at(self, ln_modulus: float) -> "Section":
        """The surfaces at one modulus of the domain."""
        place = (ln_modulus - self._y0) * self._per_y
        j = min(max(int(place), 0), self._n - 1)
        u = place - j
        per_y = self._per_y
        powers = np.array([[1.0, 0.0], [u, per_y], [u * u, 2 * u * per_y], [u * u * u, 3 * u * u * per_y]])
        return Section(ln_modulus, powers, self._columns[j], self._x0, self._per_x)


class Section:
    """Surfaces at one modulus: cubics over ln force, made for a cell when it is asked for the first time."""

    __slots__ = ("_cells", "_cubics", "_per_x", "_powers", "_x0", "ln_modulus")

    def __init__(self, ln_modulus: float, powers: np.ndarray, cells: list[np.ndarray], x0: float, per_x: float):
        self.ln_modulus, self._powers, self._cells, self._x0, self._per_x = ln_modulus, powers, cells, x0, per_x
        self._cubics: dict[int, list[list[float]]] = {}

    def evaluate(self, ln_force: float) -> tuple[int, list[tuple[float, float, float, float]]]:
        """The force cell of a point of the domain, and of each surface there its value, its slope in ln E, its slope in
        ln force and the second derivative in ln force."""
        # Comparisons: `min` and `max` take as long as a cubic, and this is where a loop spends its time.
        per_x = self._per_x
        t = (ln_force - self._x0) * per_x
        cell, last = int(t), len(self._cells) - 1
        cell = 0 if cell < 0 else last if cell > last else cell
        t -= cell
        square = per_x * per_x
        return cell, [
            (
                p0 + t * (p1 + t * (p2 + t * p3)),
                a0 + t * (a1 + t * (a2 + t * a3)),
                per_x * (p1 + t * (2 * p2 + 3 * t * p3)),
                square * (2 * p2 + 6 * t * p3),
            )
            for p0, a0, p1, a1, p2, a2, p3, a3 in self._cubics.get(cell) or self._cut(cell)
        ]

    def is_far(self, ln_modulus: float, variance: float) -> bool:
        """Whether samples should be linearised anew, for a modulus that is known with this variance of ln E."""
        moved = ln_modulus - self.ln_modulus
        moved *= moved
        return moved > REACH * REACH * variance or moved > MOST_REACH * MOST_REACH

    def cut_all(self) -> None:
        """Make all cubics now."""
        for cell in range(len(self._cells)):
            self._cut(cell)

    def _cut(self, cell: int) -> list[list[float]]:
        self._cubics[cell] = cubics = (self._cells[cell] @ self._powers).reshape(-1, 8).tolist()
        return cubics


class ForceTable:
    """ln force over (modulus node, level of ln |readings|), bilinear: where to linearise, no more."""

    def __init__(self, rows: list[list[float]], low: float, per_level: float, y0: float, per_y: float, lowest: float):
        self._rows, self._low, self._per_level, self._y0, self._per_y = rows, low, per_level, y0, per_y
        self.lowest = lowest

    def ln_force(self, ln_norm: float, ln_modulus: float) -> tuple[float, float]:
        """ln force, and its slope in ln_norm; beyond the table, its end."""
        s = (ln_norm - self._low) * self._per_level
        s = 0.0 if s < 0.0 else LEVELS - 1.0 if s > LEVELS - 1.0 else s
        u = (ln_modulus - self._y0) * self._per_y
        k, j, last = int(s), int(u), len(self._rows) - 2
        k = LEVELS - 2 if k > LEVELS - 2 else k
        j = 0 if j < 0 else last if j > last else j
        s, u = s - k, u - j
        below, above = self._rows[j], self._rows[j + 1]
        left = below[k] + u * (above[k] - below[k])
        rise = below[k + 1] + u * (above[k + 1] - below[k + 1]) - left
        return left + s * rise, rise * self._per_level

    def ln_forces(self, ln_norm: float, nodes: list[int]) -> list[float]:
        """ln force at modulus nodes; beyond the table, its end."""
        s = min(max((ln_norm - self._low) * self._per_level, 0.0), LEVELS - 1.0)
        k = min(int(s), LEVELS - 2)
        rows = [self._rows[node] for node in nodes]
        return [row[k] + (s - k) * (row[k + 1] - row[k]) for row in rows]


def sd_force_table(surface: Surface) -> ForceTable:
    """Force from ln S_d; where S_d falls over force, the last place before."""
    modulus = surface.modulus_axis
    forces, moduli = _grid(surface)
    values = np.maximum.accumulate(surface(forces, moduli[:, None]), axis=1) + LEAST_RISE * np.arange(len(forces))
    return _force_table(values, np.log(forces), modulus.start, 1 / modulus.step)


def _grid(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """Some forces in each cell, and the modulus nodes, ends exact."""
    low, high = surface.force_N
    forces = np.geomspace(low, high, FORCES_PER_CELL * surface.cells[0] + 1)
    moduli = surface.modulus_axis.nodes
    forces[[0, -1]], moduli[[0, -1]] = (low, high), surface.modulus_MPa
    return forces, moduli


def _force_table(norms: np.ndarray, ln_forces: np.ndarray, y0: float, per_y: float) -> ForceTable:
    low, high = float(norms.min()), float(norms.max())
    levels = np.linspace(low, high, LEVELS)
    rows = [np.interp(levels, row, ln_forces).tolist() for row in norms]
    return ForceTable(rows, low, (LEVELS - 1) / (high - low), y0, per_y, math.exp(float(norms[:, 0].min())))


def _groups(surfaces) -> list[int]:
    """Number of the group of each gauge: those whose surfaces are the same are in one."""
    groups: list[int] = []
    for number, surface in enumerate(surfaces):
        size = np.abs(surface.coefficients).max()
        same = [
            groups[other]
            for other in range(number)
            if np.abs(surfaces[other].coefficients - surface.coefficients).max() <= SAME * size
        ]
        groups.append(same[0] if same else max(groups, default=-1) + 1)
    return groups


def distance_curve(slopes: np.ndarray, start: float, per_step: float) -> Curve:
    """A rising curve h(ln E) from dh / d ln E > 0 at its n + 1 nodes: piecewise cubic Hermite, slopes limited so that
    it rises everywhere (Fritsch and Carlson 1980, doi:10.1137/0717021)."""
    steps = 0.5 * (slopes[:-1] + slopes[1:]) / per_step
    values = np.concatenate([[0.0], np.cumsum(steps)])
    ends = slopes / per_step
    left, right = np.minimum(ends[:-1], 3 * steps), np.minimum(ends[1:], 3 * steps)
    cubics = np.column_stack([values[:-1], left, 3 * steps - 2 * left - right, left + right - 2 * steps])
    return Curve(tuple(map(tuple, cubics.tolist())), tuple(values.tolist()), start, per_step)
