"""The sensor's side: turns the estimates of every sample into the few quantities that are sent.

The pipeline gives the wavelength lambda_1 of the strongest line, but no amplitude, which the display needs. Over the
last 0.2 s the reading y of a gauge is fitted by least squares as

    y = sum_i (a_i cos(2 pi x / lambda_i) + b_i sin(2 pi x / lambda_i)) + c + d x,

x being the path, not the time: lines stay sharp while the hand changes its speed. The amplitude is sqrt(a_i^2 + b_i^2).
The terms c + d x take the pressing, which is far stronger than a texture and slow. With less than 1.5 periods of path
sine, cosine and straight line cannot be told apart, and the earlier texture is kept.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from papilla.core.errors import FileFormatError, InputError
from papilla.core.tables import TableReader
from papilla.core.units import SAMPLE_RATE_HZ
from papilla.estimators.friction import FrictionStatus
from papilla.estimators.pipeline import Pipeline, PipelineEstimate
from papilla.estimators.wavelength.memory import TrackingStatus
from papilla.telepresence import messages
from papilla.telepresence.messages import Component, Header, Parameters, QuantityTrust, quantity

AMPLITUDE_WINDOW_S = 0.2
"""Time over which amplitudes are measured."""
FEWEST_WINDOW_PERIODS = 1.5
"""Smallest number of periods of a line in the window."""
FURTHER_LINE_CHANCE = 1e-6
"""Probability that noise alone makes a line as strong, below which a further line is sent."""
ALIKE_LINE_DIFFERENCE = 0.02
"""Relative difference of wavelength within which two lines count as one."""
_HELD = {
    status.code
    for status in (
        TrackingStatus.STANDSTILL,
        TrackingStatus.MISSING,
        TrackingStatus.NO_VELOCITY,
        TrackingStatus.ALIASED,
    )
}


class Sensing:
    """Quantities for a message from the samples of a pipeline: the texture's lines, E, friction and contact area.

    The wavelength of the pipeline is the first line; further lines of its last spectrum over the path follow, up to the
    requested number. Their amplitudes (microstrain) come from a common fit of sines to the last 0.2 s of the gauge with
    the strongest first line. Modulus, area and friction have the status OK if their estimator says "ok", and DOUBTED if
    it adds a note.

    Parameters
    ----------
    pipeline : with a velocity or a position among its columns.
    components : largest number of lines that are sent.
    sample_rate_Hz : of the samples.
    area : contact area (mm2, its sigma) of a force (N) and a modulus with its sigma (MPa), as from `ContactArea`; None:
        no area is sent.

    Raises `InputError` for a pipeline without a path.
    """

    def __init__(
        self,
        pipeline: Pipeline,
        *,
        components: int = 1,
        sample_rate_Hz: float = SAMPLE_RATE_HZ,
        area: Callable[[float, float, float], tuple[float, float]] | None = None,
    ):
        if "wavelength" in pipeline.off:
            raise InputError(f"the sensor's side needs a wavelength: {pipeline.off['wavelength']}")
        self.pipeline, self.components, self._area = pipeline, components, area
        names = pipeline.columns
        measured = ("position_mm", "velocity_mm_s", "force_N")
        columns = [names.index(name) if name in names else None for name in measured]
        self._place, self._speed, self._force = columns
        self._gauges = slice(1, min(column for column in (*columns, len(names)) if column is not None))
        self._dt = 1 / sample_rate_Hz
        self._window = round(AMPLITUDE_WINDOW_S * sample_rate_Hz)
        self._rows = np.zeros((self._window, self._gauges.stop))
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.pipeline.reset()
        self._count, self._integral = 0, 0.0
        self._answer: PipelineEstimate | None = None
        self._sample: tuple[float, ...] = ()

    def update(self, sample: Sequence[float]) -> None:
        """Take one sample, in the order of the pipeline's columns."""
        self._answer = self.pipeline.update(sample)
        self._sample = tuple(sample)
        if self._place is not None:
            place = sample[self._place]
        else:
            assert self._speed is not None, "a pipeline with a wavelength has one of both"
            speed = sample[self._speed]
            self._integral += speed * self._dt if math.isfinite(speed) else 0.0
            place = self._integral
        slot = self._rows[self._count % self._window]
        slot[0], slot[1:] = place, sample[self._gauges]
        self._count += 1

    def lines(self) -> tuple[tuple[Component, ...], QuantityTrust]:
        """The texture's lines, strongest first, and their `Trust`."""
        answer = self._answer
        if answer is None:
            return (), QuantityTrust.UNKNOWN
        status = str(answer.wavelength_status)
        if not status.startswith("ok"):
            return (), QuantityTrust.HELD if status in _HELD else QuantityTrust.UNKNOWN
        wavelengths = [(float(answer.wavelength_mm), float(answer.wavelength_sigma_mm))]
        for wavelength, _, chance in self.pipeline.lines:
            apart = all(abs(math.log(wavelength / earlier)) > ALIKE_LINE_DIFFERENCE for earlier, _ in wavelengths)
            if len(wavelengths) < self.components and chance < FURTHER_LINE_CHANCE and apart:
                wavelengths.append((wavelength, math.nan))
        amplitudes = self._fit([wavelength for wavelength, _ in wavelengths])
        if amplitudes is None:
            return (), QuantityTrust.HELD
        lines = [
            Component(wavelength, amplitude, sigma, spread)
            for (wavelength, sigma), (amplitude, spread) in zip(wavelengths, amplitudes, strict=True)
        ]
        return messages.strongest(tuple(lines), self.components), QuantityTrust.OK

    def _fit(self, wavelengths: list[float]) -> list[tuple[float, float]] | None:
        """(amplitude, sigma) of sines with these wavelengths over the path; None if the path is too short."""
        rows = self._rows[: min(self._count, self._window)]
        rows = rows[np.isfinite(rows).all(axis=1)]
        if len(rows) < 4 * len(wavelengths) + 8 or np.ptp(rows[:, 0]) < FEWEST_WINDOW_PERIODS * wavelengths[0]:
            return None
        turns = 2 * math.pi * rows[:, :1] / np.array(wavelengths)
        # The straight line is zero in the middle of the path, so that d is not correlated with c.
        design = np.hstack([np.cos(turns), np.sin(turns), np.ones((len(rows), 1)), rows[:, :1] - rows[:, 0].mean()])
        solution, _, rank, _ = np.linalg.lstsq(design, rows[:, 1:], rcond=None)
        if rank < design.shape[1]:
            return None
        number = len(wavelengths)
        sizes = np.hypot(solution[:number], solution[number : 2 * number])
        gauge = int(np.argmax(sizes[0]))
        residual = rows[:, 1 + gauge] - design @ solution[:, gauge]
        # White noise of variance s^2 in n rows gives an amplitude the variance 2 s^2 / n; s^2 is estimated from the
        # residual, and n reduced by the number of unknowns in both places.
        sigma = math.sqrt(2 * float(residual @ residual)) / (len(rows) - design.shape[1])
        return [(float(size), sigma) for size in sizes[:, gauge]]

    def parameters(self, header: Header) -> Parameters:
        """The present message, with this header."""
        lines, trust = self.lines()
        return Parameters(header, int(trust), messages.lines_of(lines), **self._softness(), **self._friction())

    def _softness(self) -> dict[str, Any]:
        """Present force, modulus and contact area, as far as they are estimated."""
        answer = self._answer
        if answer is None or self._force is None:
            return {}
        force = self._sample[self._force]
        quantities: dict[str, Any] = {"force": quantity(messages.Force, force)}
        if "modulus" not in self.pipeline.off:
            modulus, sigma = float(answer.modulus_MPa), float(answer.modulus_sigma_MPa)
            trust = _trust(self.pipeline.sentences.get("modulus", "").startswith("ok"))
            quantities["modulus"] = quantity(messages.Modulus, modulus, sigma, trust)
            if self._area is not None:
                quantities["area"] = quantity(messages.Area, *self._area(force, modulus, sigma), trust)
        return quantities

    def _friction(self) -> dict[str, Any]:
        """Both present coefficients, if they are estimated."""
        estimate = self.pipeline.friction
        if estimate is None:
            return {}
        trust, names = _trust(FrictionStatus(int(estimate.status)).good), ("mu_kinetic", "mu_static")
        both = ((name, float(getattr(estimate, name)), float(getattr(estimate, f"{name}_sigma"))) for name in names)
        return {name: quantity(messages.Ratio, value, sigma, trust) for name, value, sigma in both}


def _trust(good: bool) -> QuantityTrust:
    return QuantityTrust.OK if good else QuantityTrust.DOUBTED


AREA_SIGMA = 0.01
"""Relative standard deviation of an area by the mesh: README, areas of six meshes against axisymmetric rings."""
SOFTNESS_COLUMNS = ("force_N", "modulus_MPa", "contact_area_mm2")


@dataclass(frozen=True, eq=False)
class ContactArea:
    """Contact area over force and modulus, interpolated linearly in the logarithms of all three; NaN outside.

    Parameters
    ----------
    force_N (m,), modulus_MPa (k,) : rising. area_mm2 : (k, m), NaN if there is none.

    Raises `InputError` for other shapes, axes that do not rise, and fewer than two values of either.
    """

    force_N: np.ndarray
    modulus_MPa: np.ndarray
    area_mm2: np.ndarray

    def __post_init__(self):
        for name in ("force_N", "modulus_MPa"):
            axis = getattr(self, name)
            if axis.ndim != 1 or axis.size < 2 or not (axis[0] > 0 and (np.diff(axis) > 0).all()):
                raise InputError(f"{name} must be two or more positive numbers that rise")
        if self.area_mm2.shape != (self.modulus_MPa.size, self.force_N.size):
            raise InputError(f"area_mm2 must be moduli x forces, got {self.area_mm2.shape}")

    @classmethod
    def of_presses(cls, force_N: ArrayLike, modulus_MPa: ArrayLike, area_mm2: ArrayLike) -> "ContactArea":
        """From presses (n,) on a grid of forces and moduli, in any order, as in a sweep."""
        force, modulus, area = (np.asarray(values, float) for values in (force_N, modulus_MPa, area_mm2))
        forces, moduli = np.unique(force), np.unique(modulus)
        table = np.full((moduli.size, forces.size), math.nan)
        table[np.searchsorted(moduli, modulus), np.searchsorted(forces, force)] = np.where(area > 0, area, math.nan)
        return cls(forces, moduli, table)

    @classmethod
    def load(cls, path: str | PathLike) -> "ContactArea":
        """From the sweep.csv of `papilla calibrate`; raises `FileAccessError` and `FileFormatError`."""
        with TableReader(Path(path), lambda name: name in SOFTNESS_COLUMNS) as reader:
            table = reader.whole()
        if missing := [name for name in SOFTNESS_COLUMNS if name not in table.columns]:
            raise FileFormatError(
                f"{path}: no column {', '.join(missing)}: it must be a sweep.csv of papilla calibrate"
            )
        try:
            return cls.of_presses(*(table.columns[name] for name in SOFTNESS_COLUMNS))
        except InputError as error:
            raise FileFormatError(f"{path}: {error}") from error

    def __call__(self, force_N: float, modulus_MPa: float, modulus_sigma_MPa: float = 0.0) -> tuple[float, float]:
        """(area, its standard deviation) in mm2; NaN outside the table or if force or modulus are not known."""
        (force_cell, along), (modulus_cell, across) = _cell(self.force_N, force_N), _cell(self.modulus_MPa, modulus_MPa)
        if math.isnan(along + across):
            return math.nan, math.nan
        (a, b), (c, d) = np.log(self.area_mm2[modulus_cell : modulus_cell + 2, force_cell : force_cell + 2]).tolist()
        low, high = a + along * (b - a), c + along * (d - c)
        area = math.exp(low + across * (high - low))
        # The error of the modulus acts on the area by d ln A / d ln E.
        slope = (high - low) / math.log(self.modulus_MPa[modulus_cell + 1] / self.modulus_MPa[modulus_cell])
        sigma = math.hypot(AREA_SIGMA, slope * modulus_sigma_MPa / modulus_MPa)
        return area, area * sigma


def _cell(axis: np.ndarray, value: float) -> tuple[int, float]:
    """Interval of a rising axis, and the share of its logarithm that lies below the value; NaN outside the axis."""
    if not axis[0] <= value <= axis[-1]:
        return 0, math.nan
    number = min(int(np.searchsorted(axis, value, side="right")) - 1, axis.size - 2)
    return number, math.log(value / axis[number]) / math.log(axis[number + 1] / axis[number])
