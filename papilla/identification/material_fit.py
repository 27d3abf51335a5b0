"""Fit a hyperelastic material to test data by least squares, and state what the data do not determine.

From stretch and nominal stress (MPa) of a test to the card of a layer:

>>> data = MaterialTests(stretch, stress, "uniaxial")        # several tests: MaterialTests.join([...])
>>> fitted = fit_material("ogden", data)
>>> finger = dataclasses.replace(finger, outer=Layer.of(fitted.material))

or, in a design file, `[outer] material = { model = "ogden", mu_MPa = ..., alpha = ... }`. `fitted.notes` states the
doubts.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from papilla.core.errors import InputError, SolverError
from papilla.core.least_squares import least_squares
from papilla.core.short_repr import short_repr
from papilla.model.materials import TEST_MODES, Material, NeoHookean, material_class, principal_pair

STRONG_CORRELATION = 0.95
"""Correlation of two parameters above which the fit reports it."""

ILL_CONDITIONED = 1e6
"""Condition number of the scaled Jacobian above which the fit reports it."""

MATERIAL_FIT_TOLERANCE = 1e-14
"""Relative tolerances of the search: the data may be exact."""


@dataclass(frozen=True, eq=False)
class MaterialTests:
    """Stretch and stress measured on an incompressible material, n points.

    stretch : (n,), > 0; stress : (n,) nominal stress in MPa, compression negative; mode : (n,) of `MODES`.
    """

    stretch: np.ndarray
    stress: np.ndarray
    mode: np.ndarray
    __repr__ = short_repr

    def __post_init__(self):
        stretch, stress = (np.array(getattr(self, name), dtype=float) for name in ("stretch", "stress"))
        mode = np.broadcast_to(np.asarray(self.mode, dtype=str), stretch.shape)
        if stretch.ndim != 1 or stretch.shape != stress.shape:
            raise InputError(f"stretch and stress must be equally long, got shapes {stretch.shape} and {stress.shape}")
        if not np.isfinite(stress).all():
            raise InputError("stress (MPa) must be finite everywhere")
        for name in np.unique(mode):
            principal_pair(stretch[mode == name], str(name))
        for name, value in (("stretch", stretch), ("stress", stress), ("mode", mode)):
            object.__setattr__(self, name, value)

    @classmethod
    def join(cls, parts: Sequence["MaterialTests"]) -> "MaterialTests":
        """All points of several tests."""
        return cls(*(np.concatenate([getattr(test, item.name) for test in parts]) for item in fields(cls)))


@dataclass(frozen=True, eq=False)
class MaterialFit:
    """A fitted material, k parameters, and how far to trust it.

    material : the material.
    names, values, stderr : (k,) in MPa (Ogden's alpha is a number); stderr is NaN for a parameter the data do not see.
    covariance, correlation : (k, k).
    condition : condition number of the Jacobian with columns scaled to unit length.
    rms : root mean square of the residuals in MPa over all `points`.
    stretch_range : of the data; the fit says nothing beyond it.
    notes : doubts, in sentences; empty if there are none.
    """

    material: Material
    names: tuple[str, ...]
    values: np.ndarray
    stderr: np.ndarray
    covariance: np.ndarray
    correlation: np.ndarray
    condition: float
    rms: float
    points: int
    stretch_range: tuple[float, float]
    modes: tuple[str, ...]
    notes: tuple[str, ...]
    __repr__ = short_repr


def fit_material(kind: str, data: MaterialTests) -> MaterialFit:
    """Least-squares fit of a material of `kind` ("neo-hookean", "yeoh" or "ogden") to unweighted nominal stresses.

    The problem is solved in units of the data's own shear modulus, so that units of stress do not matter. Standard
    errors use the scatter of the residuals as noise. Raises
    `InputError` if there are too few points or their stiffness is not positive, `SolverError` if the search does not
    converge.
    """
    cls = material_class(kind)
    names = tuple(item.name for item in fields(cls))
    moving = data.stretch != 1
    if moving.sum() <= len(names):
        raise InputError(f"{kind} has {len(names)} parameters: it needs more than {moving.sum()} points off stretch 1")
    scale = _shear_modulus(data)
    unit = np.array([1.0 if name == "alpha" else scale for name in names])
    start, low, high = np.array([cls.fit_from[name] for name in names]).T

    def residual(x):
        return (model_stress(cls(*(x * unit)), data) - data.stress) / scale

    tight: dict = dict.fromkeys(("xtol", "ftol", "gtol"), MATERIAL_FIT_TOLERANCE)
    fit = least_squares(residual, start, jac="3-point", bounds=(low, high), x_scale="jac", **tight)
    if not fit.converged:
        raise SolverError(f"the {kind} fit did not converge: {fit.message}")
    covariance = fit.covariance * np.outer(unit, unit)
    stderr = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = covariance / np.outer(stderr, stderr)
    notes = [f"the data do not determine {names[k]}" for k in np.flatnonzero(~fit.determined)]
    notes += [f"{names[k]} stopped at its bound" for k in np.flatnonzero(fit.at_bound)]
    notes += [f"{names[k]} did not move from its start value" for k in np.flatnonzero(fit.vector == start)]
    for i, j in zip(*np.tril_indices(len(names), -1), strict=True):
        if abs(correlation[i, j]) > STRONG_CORRELATION:
            notes.append(f"{names[j]} and {names[i]} are correlated by {correlation[i, j]:.3f}")
    if fit.condition > ILL_CONDITIONED:
        notes.append(f"the problem is ill-conditioned ({fit.condition:.1e}): the parameters are not determined apart")
    return MaterialFit(
        material=cls(*(fit.vector * unit).tolist()),
        names=names,
        values=fit.vector * unit,
        stderr=stderr,
        covariance=covariance,
        correlation=correlation,
        condition=fit.condition,
        rms=float(np.sqrt(fit.cost / len(data.stretch)) * scale),
        points=len(data.stretch),
        stretch_range=(float(data.stretch.min()), float(data.stretch.max())),
        modes=tuple(mode for mode in TEST_MODES if (data.mode == mode).any()),
        notes=tuple(notes),
    )


def model_stress(material: Material, data: MaterialTests) -> np.ndarray:
    """Nominal stress (n,) in MPa of a material in the tests of `data`."""
    stress = np.empty(len(data.stretch))
    for mode in TEST_MODES:
        of_mode = data.mode == mode
        stress[of_mode] = material.nominal_stress(data.stretch[of_mode], mode)
    return stress


def _shear_modulus(data: MaterialTests) -> float:
    """The shear modulus (MPa) of a neo-Hookean least-squares fit; all other parameters are scaled by it."""
    unit = model_stress(NeoHookean(1.0), data)
    scale = float(unit @ data.stress / (unit @ unit))
    if not scale > 0:
        raise InputError(f"the data have no positive stiffness: a neo-Hookean fit gives mu = {scale:.3g} MPa")
    return scale
