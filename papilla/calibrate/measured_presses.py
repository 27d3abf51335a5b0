"""A calibration from measured presses: few moduli, noise, forces that no grid planned, and cells that dropped out."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import stdtrit

from papilla.calibrate.fitting import provenance
from papilla.calibrate.identification.log_check import LEAST_MICROSTRAIN, RUBBER_MPA, SOFT_MPA
from papilla.calibrate.published_form import fit_quadratic
from papilla.calibrate.surface_fit import (
    CELLS_PER_VALUE,
    FEW_VALUES,
    POLYNOMIAL_CELLS,
    Fitted,
    Resolution,
    SurfaceFit,
    uncertainty,
    usable_part,
)
from papilla.calibration import NORMAL_FACTOR, Calibration, GaugeSurface, SdSurface
from papilla.errors import InputError
from papilla.logs import PressLog

POLYNOMIALS = ((1, 1, 1), (1, 1, 2), (2, 1, 3), (2, 2, 2), (3, 2, 3), (2, 2, 4), (3, 2, 5), (3, 3, 6))
"""Degrees in ln force and ln modulus, and the largest sum of both in one term."""
COARSER = (0.15, 0.25, 0.4, 0.65, 1.0)
"""Shares of the cells that a noise-free table of these forces and moduli would get."""
SPARE = 200
"""Presses beyond the unknowns that bear them where they are less than half of the presses (a noise-free table)."""
UNSURE = 2.0
"""Largest variance of a surface within its domain, in variances of a single press."""
EDGE = 1.1
"""Presses up to this factor beyond the shared forces are fitted too, in a log of less than `SPARE`: a force that was
planned is not met exactly."""
SAME_FORCE = 0.02
"""Forces that differ by less than this fraction count as one, when degrees and cells are chosen."""
STANDS_OUT, MATERIAL = 0.01, 0.05
"""A press is left out where noise would do so to one log in a hundred, and it is off by this fraction of its S_d."""
LARGEST_SHARE_OUT = 0.1
ROUNDING = 1e-9
"""Of the data: no residual is taken to be smaller."""
NEXT_DEGREE = 0.25
"""What a further degree in ln modulus would change, in what the last one did: 0.04 to 0.46 on the default finger."""
FORM_CELLS = Resolution(12)
LIGHT_N, HEAVY_N = 5.0, 50.0
"""Where all presses are heavier than the first, or one is heavier than the second, the forces are not in N."""


def fit_bench(log: PressLog, finger: dict | None = None) -> Calibration:
    """Fit a calibration to a log of measured presses.

    S_d and the gauges' readings are smooth surfaces with as many unknowns as the presses bear, chosen by generalised
    cross-validation (Craven and Wahba 1979, doi:10.1007/BF01404567). They answer over the forces that every modulus was
    pressed with; presses far outside these are used by the quadratic alone, and a note counts them. Presses that stand
    out are left out, and a note names them. finger : {"name", "sha256"} for the record.

    Raises `InputError` for gauges other than g1, g2, ... without a gap, moduli that cannot be in MPa, too few presses,
    moduli or forces, moduli that share no range of forces, an S_d of zero, or off-centre presses.
    """
    _refuse(log)
    limits = _shared_forces(log)
    edge = EDGE if len(log) < SPARE else 1.0
    near = (log.force_N >= limits[0] / edge) & (log.force_N <= limits[1] * edge)
    data = _Presses(log, np.flatnonzero(near), limits)
    data, outliers = _without_outliers(data)
    solver = data.best()
    sd, *gauges = (_with_form(data, solver, values) for values in data.quantities)
    usable, twofold = usable_part(sd.surface)
    whole = np.setdiff1d(np.arange(len(log)), [row for row, _ in outliers])
    forward = fit_quadratic(log.force_N[whole], log.modulus_MPa[whole], log.sd_microstrain[whole])
    return Calibration(
        finger=finger or {"name": "", "sha256": ""},
        mesh={},
        forward=forward,
        inverse=forward.inverse,
        surface=SdSurface(sd.surface, usable, twofold, uncertainty(sd)),
        gauges=tuple(
            GaugeSurface(name, gauge.surface, uncertainty(gauge))
            for name, gauge in zip(log.gauge_names, gauges, strict=True)
        ),
        provenance=provenance("bench log", presses=len(log), left_out=len(log) - len(data.rows)),
        notes=(
            *(note for _, note in outliers),
            *forward.notes,
            *(
                ["indentation_mm is not used: a free form is of S_d and gauges alone"]
                if log.indentation_mm is not None
                else []
            ),
            *_doubts(solver, data.quantities[0], len(np.unique(data.modulus_MPa)), int((~near).sum()), usable),
        ),
    )


@dataclass(frozen=True, eq=False)
class _Presses:
    """The n presses that a surface is fitted to.

    rows : (n,) their places in the `log`; limits : domain of force.
    """

    log: PressLog
    rows: np.ndarray
    limits: tuple[float, float]

    @property
    def force_N(self) -> np.ndarray:
        """(n,) forces."""
        return self.log.force_N[self.rows]

    @property
    def modulus_MPa(self) -> np.ndarray:
        """(n,) moduli of the specimens."""
        return self.log.modulus_MPa[self.rows]

    @cached_property
    def quantities(self) -> np.ndarray:
        """(g + 1, n) what is fitted: ln S_d, and each gauge's reading / force."""
        return np.vstack([np.log(self.log.sd_microstrain[self.rows]), self.log.readings[self.rows].T / self.force_N])

    @cached_property
    def shares(self) -> np.ndarray:
        """(g + 1, n) the factor that makes a difference of a quantity a fraction of S_d or of the reading, whichever is
        larger."""
        readings, sd = np.abs(self.log.readings[self.rows].T), self.log.sd_microstrain[self.rows]
        return np.vstack([np.ones(len(self.rows)), self.force_N / np.maximum(sd, readings)])

    def borne(self) -> list[SurfaceFit]:
        """The surfaces that these presses bear, from few unknowns to many.

        They bear unknowns up to half their number, or all but `SPARE` of it, as long as the variance of the surface
        stays below `UNSURE`. Raises `InputError` where not even a plane is borne.
        """
        count, found = len(self.force_N), []
        ends = self.limits, (float(self.modulus_MPa.min()), float(self.modulus_MPa.max()))
        places = np.meshgrid(*(np.clip(np.geomspace(*limits, 9), *limits) for limits in ends))
        for along, total in self._forms():
            try:
                solver = SurfaceFit(self.force_N, self.modulus_MPa, along, total, self.limits)
            except InputError:
                continue
            few = count - solver.freedom <= max(count / 2, count - SPARE)
            if few and solver.leverage(*(place.ravel() for place in places)).max() <= UNSURE:
                found.append(solver)
        if not found:
            raise InputError(f"{count} presses, placed like these, do not bear even a plane: spread them over forces")
        return found

    def _forms(self) -> list[tuple[tuple[Resolution, Resolution], int | None]]:
        """Polynomials of rising degree, then splines of ever more cells, as far as the values differ."""
        forces, moduli = _distinct(self.force_N, self.modulus_MPa), len(np.unique(self.modulus_MPa))
        forms: list[tuple[tuple[Resolution, Resolution], int | None]] = [
            ((Resolution(POLYNOMIAL_CELLS, a), Resolution(POLYNOMIAL_CELLS, b)), total)
            for a, b, total in POLYNOMIALS
            if a < forces and b < moduli
        ]
        if forces >= FEW_VALUES:
            for share in COARSER:
                along = [
                    Resolution(max(4, round(share * CELLS_PER_VALUE * values)))
                    if values >= FEW_VALUES
                    else Resolution(POLYNOMIAL_CELLS, min(values - 1, 3))
                    for values in (forces, moduli)
                ]
                forms.append(((along[0], along[1]), None))
        return forms

    def best(self) -> SurfaceFit:
        """Of the surfaces that are borne, that of the least expected error of a new press, over all quantities.

        One that is straight in ln modulus is taken where no curved one is borne: S_d saturates, and what noise hides of
        that at the moduli is more between them.
        """

        def expected(solver: SurfaceFit) -> float:
            squares = [float((solver.surface(values).residual ** 2).sum()) for values in self.quantities]
            floors = [float((values**2).sum()) * ROUNDING**2 for values in self.quantities]
            return float(np.log(np.maximum(squares, floors)).mean()) - 2 * np.log(solver.freedom)

        borne = self.borne()
        curved = [one for one in borne if one.along[1].degree != 1]
        return min(curved or borne, key=expected)


def _without_outliers(data: _Presses) -> tuple[_Presses, list[tuple[int, str]]]:
    """The presses without those that stand out, and for each of these its place in the log and a sentence.

    The worst is left out, then all is judged anew: by deleted residuals against Student's t, for all presses and
    quantities at once (Cook and Weisberg 1982, section 2.2), of the finest surface that is borne.
    """
    found: list[tuple[int, str]] = []
    most = max(1, int(LARGEST_SHARE_OUT * len(data.rows)))
    while (worst := _worst(data)) is not None:
        place, sentence = worst
        if len(found) == most:
            count = most + len(data.rows)
            raise InputError(f"more than {most} of {count} presses do not go with the others; among them {sentence}")
        found.append((int(data.rows[place]), f"{sentence}; it is left out"))
        data = replace(data, rows=np.delete(data.rows, place))
    return data, found


def _worst(data: _Presses) -> tuple[int, str] | None:
    """The press that stands out most, and what it does so by; None where none does."""
    solver = data.borne()[-1]
    freedom = solver.freedom - 1
    if freedom < 1:
        return None
    left = np.maximum(1 - solver.leverage(), ROUNDING)
    residual = np.array([solver.surface(values).residual for values in data.quantities])
    others = (residual**2).sum(axis=1, keepdims=True) - residual**2 / left
    floor = ROUNDING * np.abs(data.quantities).max(axis=1, keepdims=True)
    score = np.abs(residual) / np.sqrt(left) / np.maximum(np.sqrt(np.maximum(others, 0) / freedom), floor)
    score[np.abs(residual / left) * data.shares < MATERIAL] = 0
    out = score > stdtrit(freedom, 1 - STANDS_OUT / 2 / score.size)
    if not out.any():
        return None
    place = int(np.argmax(np.where(out, score, 0).max(axis=0)))
    press, values = f"press {data.rows[place] + 1}", data.quantities[:, place]
    expected = values - residual[:, place] / left[place]
    gauges = np.flatnonzero(out[1:, place]) + 1
    if len(gauges) == 1:
        found, said = (float(number[gauges[0]] * data.force_N[place]) for number in (values, expected))
        return place, f"{press}: g{gauges[0]} reads {found:.4g} µε where the other presses say {said:.4g} µε"
    found, said = (float(np.exp(number[0])) for number in (values, expected))
    return place, f"{press}: S_d is {found:.4g} µε where the other presses say {said:.4g} µε"


def _with_form(data: _Presses, solver: SurfaceFit, values: np.ndarray) -> Fitted:
    """The surface through (n,) values, and what it may be off by from place to place, beyond its rms.

    Noise moves it more where presses are far away, its leverage beyond the mean of the presses'. With as many unknowns
    as moduli, these cannot show the error of the form: the next degree that goes through them all differs by a multiple
    of their node polynomial, which is most in the widest gap (Davis, Interpolation and Approximation, 1963, theorem
    3.1.1), and is taken to change `NEXT_DEGREE` of what the last one did.
    """
    fitted, (along_force, along_modulus) = solver.surface(values), solver.along
    count, moduli, degree = len(values), np.unique(data.modulus_MPa), along_modulus.degree
    axes = fitted.surface.force_axis, fitted.surface.modulus_axis
    force, modulus = np.meshgrid(*(axis.nodes.clip(axis.low, axis.high) for axis in axes))
    places = force.ravel(), modulus.ravel()
    more = np.maximum(solver.leverage(*places) - (1 - solver.freedom / count), 0.0).reshape(force.shape)
    spread = more / (2 - solver.freedom / count) * (fitted.rms * fitted.factor / NORMAL_FACTOR) ** 2
    if degree is not None and degree + 1 == len(moduli):
        coarse = SurfaceFit(
            data.force_N, data.modulus_MPa, (along_force, replace(along_modulus, degree=degree - 1)), None, data.limits
        )
        change = fitted.surface(force, modulus) - coarse.surface(values).surface(force, modulus)
        nodes = np.prod(np.log(modulus[:, :, None] / moduli), axis=2) ** 2
        spread += NEXT_DEGREE**2 * nodes * (change**2).mean(axis=0) / nodes.mean(axis=0)
    form = SurfaceFit(*places, (FORM_CELLS, FORM_CELLS)).surface(np.sqrt(spread).ravel()).surface
    rounding = ROUNDING * float(np.abs(values).max())
    return replace(fitted, rms=float(np.hypot(fitted.rms, rounding)), form=form)


def _refuse(log: PressLog) -> None:
    """Refuse what cannot be one calibration: another sensor's columns, another unit, several touch-down points."""
    expected = tuple(f"g{number}" for number in range(1, len(log.gauge_names) + 1))
    if log.gauge_names != expected:
        missing = next(name for name in expected if name not in log.gauge_names)
        raise InputError(
            f"the log has the gauges {', '.join(log.gauge_names)}, but {missing} is missing: "
            "a calibration is for g1, g2, ... in the order of the finger's gauges"
        )
    for name in ("x_mm", "y_mm"):
        place = getattr(log, name)
        if place is not None and np.ptp(place) > 0:
            raise InputError(
                f"the presses differ in {name} ({place.min():g} to {place.max():g}): "
                "a calibration is for one touch-down point, keep the presses of one"
            )
    moduli = np.unique(log.modulus_MPa)
    if moduli[0] > SOFT_MPA or moduli[-1] > RUBBER_MPA:
        raise InputError(
            f"modulus_MPa goes from {moduli[0]:g} to {moduli[-1]:g} MPa, which is no softness: is it in kPa? "
            f"A calibration takes specimens of {RUBBER_MPA:g} MPa at most, the softest below {SOFT_MPA:g}"
        )
    lightest, heaviest = log.force_N.min(), log.force_N.max()
    if lightest > LIGHT_N or heaviest > HEAVY_N:
        raise InputError(
            f"force_N goes from {lightest:g} to {heaviest:g} N, which no soft finger takes: is it in gf? "
            f"The lightest press must be below {LIGHT_N:g} N, the heaviest below {HEAVY_N:g}"
        )
    if len(moduli) < 3:
        raise InputError(f"a calibration needs specimens of three moduli at least, got {len(moduli)}")
    if (log.sd_microstrain <= 0).any():
        row = int(np.argmax(log.sd_microstrain <= 0))
        raise InputError(f"press {row + 1} has the same reading on all gauges, so S_d is 0")
    if (largest := float(np.abs(log.readings).max())) < LEAST_MICROSTRAIN:
        raise InputError(
            f"no gauge reads more than {largest:.3g}: readings are expected in microstrain, are these strains?"
        )


def _shared_forces(log: PressLog) -> tuple[float, float]:
    """The range of forces that every modulus was pressed with."""
    groups = [log.force_N[log.modulus_MPa == modulus] for modulus in np.unique(log.modulus_MPa)]
    low, high = max(group.min() for group in groups), min(group.max() for group in groups)
    if not low < high:
        raise InputError(f"the moduli share no range of forces: one starts at {low:g} N, another ends at {high:g} N")
    return float(low), float(high)


def _distinct(force_N: np.ndarray, modulus_MPa: np.ndarray) -> int:
    """How many different forces the modulus with the fewest of them was pressed with."""
    groups = (np.sort(np.log(force_N[modulus_MPa == modulus])) for modulus in np.unique(modulus_MPa))
    return min(1 + int((np.diff(group) > SAME_FORCE).sum()) for group in groups)


def _doubts(solver: SurfaceFit, ln_sd: np.ndarray, moduli: int, outside: int, usable: np.ndarray) -> list[str]:
    along_force, along_modulus = solver.along
    notes = [f"ln S_d is {along_force.in_words} in ln force and {along_modulus.in_words} in ln modulus"]
    if along_modulus.degree is not None and moduli == along_modulus.degree + 1:
        notes.append(
            f"between the {moduli} moduli S_d is assumed to follow this curve: intervals include a quarter of what its "
            "last degree changes"
        )
    share = 1 - float((usable[:, 1] - usable[:, 0]).mean()) / along_modulus.cells
    if share > 0:
        notes.append(
            f"S_d does not rise with the modulus in {100 * share:.0f} % of the domain: no modulus is told there"
        )
    if (rms := solver.surface(ln_sd).rms) > MATERIAL:
        notes.append(f"the presses miss the surface by {100 * rms:.0f} % rms: far more than a bench should")
    if outside:
        notes.append(f"{outside} presses lie outside the forces that all moduli share: the surface does not use them")
    return notes
