"""The start of a touch: the contact that explains a first sample best, and which channels may be wrong in it."""

import math

import numpy as np

from papilla.estimators.softness.channels import SPREAD_FORCE
from papilla.estimators.softness.fitter import LARGEST_LINEARISATION_BEND, FilterState, Fitter, Residuals, shares_of
from papilla.estimators.stream import Pieces

FIRST_STEPS, STEPS_A_PIECE = 15, 3
"""Largest number of Gauss-Newton steps for the first sample of a touch, and the number done within one sample."""
FITTED_SUSPECT_SETS = 4
"""Number of sets of suspects, the likeliest first, that are fitted if a first sample fits badly."""
START_MODULI, START_FORCES = 7, 9
"""Nodes of the table of contacts over h, and over ln force and place, from the best of which Gauss-Newton starts."""
FIRST_SAMPLE_REACH = 4.0
"""How many times further from its node a first sample may lie than a later sample from the one before it."""

Fitted = Pieces[tuple[Residuals, FilterState]]


class Start:
    """The start of a touch: the calibrated contact (force, place, h) that explains a first sample best.

    Readings are curved over modulus and force, so Gauss-Newton from a fixed contact may end in a wrong one. The
    channels are linearised once at each node of a table, 7 x 9 (x 9 places) contacts. A first sample y has at each node
    the misfit |L (y - r)|^2, r being the readings expected there and L' L = (H H' + B B' + 1)^-1; one matrix product
    covers all nodes. Gauss-Newton then starts from the best node. The same table shows which channels, left out, leave
    a small misfit.
    """

    def __init__(self, fitter: Fitter):
        self._fitter = fitter
        self._known = fitter.anywhere and math.isfinite(fitter.position_sigma)
        hs, forces = np.linspace(0.0, fitter.top, START_MODULI), np.linspace(fitter.low, fitter.high, START_FORCES)
        reach = fitter.surfaces.reach
        places = np.linspace(-reach, reach, START_FORCES) if fitter.anywhere else np.zeros(1)
        self._nodes = [(force, place, h) for h in hs.tolist() for place in places.tolist() for force in forces.tolist()]
        linears = [fitter.linear(*node) for node in self._nodes]
        # A contact between nodes must not count as a misfit: h, force and place are free by one step of the table.
        prior = np.ones(fitter.size)
        prior[0] = (hs[1] - hs[0]) ** 2
        narrow = np.array([[(forces[1] - forces[0]) / SPREAD_FORCE], [2 / (START_FORCES - 1)]])
        H, B = np.array([linear.H for linear in linears]), np.array([linear.B for linear in linears]) * narrow
        self._covariances = (H * prior) @ H.transpose(0, 2, 1) + B.transpose(0, 2, 1) @ B + np.eye(fitter.channels + 1)
        self._expected = np.array([linear.expected for linear in linears])
        self._tables: dict[tuple[int, ...], tuple[np.ndarray, ...]] = {}
        self._table(np.arange(fitter.channels + math.isfinite(fitter.noise[-1])))

    def _table(self, rows: np.ndarray) -> tuple[np.ndarray, ...]:
        """For some channels, at all n nodes: precision (n, k, k), its square root as (n k, k), and the product of this
        root with the channels expected there (n k,)."""
        key = tuple(rows.tolist())
        if key not in self._tables:
            # With S = G G', the misfit r' S^-1 r is the squared length of G^-1 r.
            root = np.linalg.inv(np.linalg.cholesky(self._covariances[:, rows[:, None], rows]))
            precision = root.transpose(0, 2, 1) @ root
            origin = (root @ self._expected[:, rows, None]).ravel()
            self._tables[key] = precision, root.reshape(-1, len(rows)), origin
        return self._tables[key]

    def misfits(self, y: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """(n,) squared misfit of a sample at all n nodes of the table."""
        _, root, origin = self._table(rows)
        residuals = (root @ (y * self._fitter.whiten)[rows] - origin).reshape(-1, len(rows))
        return np.einsum("nk,nk->n", residuals, residuals)

    def __call__(self, y: np.ndarray, rows: np.ndarray, prior: FilterState) -> Fitted:
        """The misfit of a first sample, and the filter that begins with it: Gauss-Newton from the best node of the
        table for h, force and place, with `prior` for the other unknowns."""
        return self._settled(y, rows, prior, int(self.misfits(y, rows).argmin()))

    def misfits_without(
        self, y: np.ndarray, rows: np.ndarray, prior: FilterState, sets: list[tuple[int, ...]]
    ) -> Pieces[list[float]]:
        """Squared misfits of the other channels when each of some sets of channels is left out; only the likeliest few
        are fitted, the others are inf."""
        precision, misfits = self._table(rows)[0], self.misfits(y, rows)
        rest = (y * self._fitter.whiten)[rows] - self._expected[:, rows]
        weighted = (precision @ rest[..., None])[..., 0]
        # Misfits of all nodes without each set, by the formula of `gauges`: a cheap ranking, and only the best are
        # fitted.
        places = [np.searchsorted(rows, channels) for channels in sets]
        without = misfits[:, None] - shares_of(weighted, precision, places)
        fitted = [math.inf] * len(sets)
        for number in without.min(axis=0).argsort(kind="stable")[:FITTED_SUSPECT_SETS].tolist():
            others = np.setdiff1d(rows, sets[number])
            residuals, _ = yield from self._settled(y, others, prior, int(without[:, number].argmin()))
            fitted[number] = residuals.misfit
        return fitted

    def _settled(self, y: np.ndarray, rows: np.ndarray, prior: FilterState, node: int) -> Fitted:
        """The fit of ln force, place and h to one sample by Gauss-Newton steps that start at a node of the table."""
        fitter, (at, place, h) = self._fitter, self._nodes[node]
        white, reach = (y * fitter.whiten)[rows], fitter.surfaces.reach
        # A prior of the place counts for this sample and for no later one.
        wide = np.array([FIRST_SAMPLE_REACH, fitter.position_sigma / reach if self._known else FIRST_SAMPLE_REACH])
        far = np.array([1.0, 1.0 / reach if reach else 0.0])
        most = max(float(np.abs(white).max()), 1.0)
        mean, longest = prior.mean.copy(), 1.5 * fitter.top / START_MODULI
        mean[0] = 0.0
        for step in range(FIRST_STEPS):
            if step % STEPS_A_PIECE == 0:
                yield
            linear = fitter.linear(at, place, h)
            H, B = linear.H[rows], linear.B[:, rows] * wide[:, None]
            innovation = white - linear.expected[rows] - H @ mean
            # Its prior is about the apex, not about the present linearisation: shift the innovation accordingly.
            if self._known:
                innovation = innovation + B[1] * (place / fitter.position_sigma)
            residuals, PH = fitter.weighed(rows, innovation, H, B, prior.covariance, 1)
            # Limited steps: half in ln force, 1 mm, and 1.5 nodes in h. The first linearisation may be far from the
            # contact.
            moved = wide * (B @ residuals.weighted)
            if self._known:
                moved[1] -= place / reach
            change = float(PH[0] @ residuals.weighted)
            h = min(max(h + min(max(change, -longest), longest), 0.0), fitter.top)
            at, place = fitter.inside(*fitter.moved(linear, moved.clip(np.negative(far), far).tolist()))
            if fitter.bend(linear, at, place, h, 0.0) * most < LARGEST_LINEARISATION_BEND:
                break
        mean[0] = h
        return residuals, prior._replace(mean=mean, ln_force=at, place_mm=place, anchor=h)
