"""Where a touch begins: the contact, of all that are calibrated, that explains a first sample best."""

import math

import numpy as np

from papilla.estimators.softness.belief import BENT_PLACE, Belief
from papilla.estimators.softness.contrast import Contrast, share_of
from papilla.estimators.softness.fitter import BENT, SPREAD_FORCE, Fitter

STEPS = 15
TRIED = 4
"""Explanations of a first sample that fits badly which are worked out."""
MODULI, PLACES, FORCES = 7, 9, 9
"""Nodes of the table that a first sample is looked up in."""


class Start:
    """Finds the first linearisation of a fitter's touches; its table is made with it."""

    def __init__(self, fitter: Fitter):
        self._fitter = fitter
        self._precisions: dict[tuple[int, ...], np.ndarray] = {}
        self._tabulate()

    def __call__(self, y: np.ndarray, rows: np.ndarray, belief: Belief) -> tuple[Contrast, Belief]:
        """A sample's own misfit, and the belief that begins with it: from the table of all contacts, then Gauss-Newton
        for h, force and place with `belief` as prior of the rest."""
        white = y * self._fitter.whiten
        *_, left = self._looked_up(white, rows)
        return self._settled(white, rows, belief, int(left.argmin()))

    def without(self, y: np.ndarray, rows: np.ndarray, belief: Belief):
        """A function that gives the squared misfits of a sample when each of some sets of channels is left out; only
        the likeliest few are tried, the others are inf."""
        white = y * self._fitter.whiten

        def misfits(some: list[tuple[int, ...]]) -> list[float]:
            weighted, precision, left = self._looked_up(white, rows)
            each = [left - share_of(weighted, precision, np.searchsorted(rows, own)) for own in some]
            likely = sorted(range(len(some)), key=lambda number: each[number].min())[:TRIED]
            found = [math.inf] * len(some)
            for number in likely:
                others = np.setdiff1d(rows, some[number])
                found[number] = self._settled(white, others, belief, int(each[number].argmin()))[0].misfit
            return found

        return misfits

    def _looked_up(self, white: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """At all n nodes of the table: weighted (n, k), precision (n, k, k) and squared misfit (n,) of a sample."""
        key = tuple(rows.tolist())
        if key not in self._precisions:
            self._precisions[key] = np.linalg.inv(self._covariances[:, rows[:, None], rows])
        rest, precision = white[rows] - self._expected[:, rows], self._precisions[key]
        weighted = (precision @ rest[..., None])[..., 0]
        return weighted, precision, (weighted * rest).sum(axis=1)

    def _tabulate(self) -> None:
        hs = np.linspace(0.0, self._fitter.top, MODULI)
        reach = self._fitter.surfaces.reach
        places = np.linspace(-reach, reach, PLACES) if self._fitter.anywhere else np.zeros(1)
        forces = np.linspace(self._fitter.low, self._fitter.high, FORCES)
        prior = np.ones(self._fitter.size)
        prior[0] = (hs[1] - hs[0]) ** 2
        spread = np.array([forces[1] - forces[0], 2 * reach / (PLACES - 1)])[: self._fitter.own]
        nodes = [(force, place, h) for h in hs.tolist() for place in places.tolist() for force in forces.tolist()]
        found = [self._fitter.linear(*node) for node in nodes]
        H = np.array([linear.H for linear in found])
        B = np.array([linear.B for linear in found]) * spread
        S = (H * prior) @ H.transpose(0, 2, 1) + B @ B.transpose(0, 2, 1) + np.eye(self._fitter.channels + 1)
        self._nodes, self._covariances = nodes, S
        self._expected = np.array([linear.expected for linear in found])

    def _settled(self, white: np.ndarray, rows: np.ndarray, belief: Belief, node: int) -> tuple[Contrast, Belief]:
        """Gauss-Newton from a node of the table."""
        at, place, h = self._nodes[node]
        known = self._fitter.anywhere and math.isfinite(self._fitter.position_sigma)
        spread = np.array(
            [4 * SPREAD_FORCE, self._fitter.position_sigma if known else 4 * self._fitter.surfaces.reach]
        )[: self._fitter.own]
        mean = belief.mean.copy()
        mean[0] = 0.0
        P, longest = belief.covariance, 1.5 * self._fitter.top / MODULI
        contrast = None
        for _ in range(STEPS):
            expected, H, B = self._fitter.linear(at, place, h)
            rest = (white - expected - H @ mean)[rows]
            if known:
                rest = rest + B[rows, 1] * place
            H, B = H[rows], B[rows] * spread
            S = (H @ P) @ H.T + B @ B.T + np.eye(len(rows))
            precision = np.linalg.inv(S)
            weighted = precision @ rest
            contrast = Contrast(weighted, precision, rows, float(rest @ weighted))
            own = spread * (B.T @ weighted)
            if known:
                own[1] -= place
            change = float(P[0] @ (H.T @ weighted))
            moved = min(max(h + min(max(change, -longest), longest), 0.0), self._fitter.top)
            force = at + min(max(float(own[0]), -SPREAD_FORCE), SPREAD_FORCE)
            force, beside = self._fitter.inside(
                force, place + (min(max(float(own[1]), -1.0), 1.0) if self._fitter.anywhere else 0.0)
            )
            bend = (force - at) ** 2 + (BENT_PLACE * (beside - place)) ** 2 + ((moved - h) / self._fitter.top) ** 2
            at, place, h = force, beside, moved
            if bend * max(float(np.abs(white[rows]).max()), 1.0) < BENT:
                break
        mean = belief.mean.copy()
        mean[0] = h
        return contrast, belief._replace(mean=mean, ln_force=at, place_mm=place, anchor=h)  # type: ignore[return-value]
