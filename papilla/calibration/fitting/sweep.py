"""A table of presses over force and modulus: what a calibration is fitted to."""

import itertools
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from papilla.calibration.published import SPECIMENS_MPA
from papilla.core import cache, checks
from papilla.core.errors import ContactRangeError, FileFormatError, InputError
from papilla.core.outside import json_value
from papilla.core.progress import CountedStep, Progress, silent
from papilla.core.short_repr import html_table
from papilla.core.tables import write_table
from papilla.core.units import gf_to_newton, newton_to_gf
from papilla.fem import Press, ReducedFinger
from papilla.fem.pressing.fidelity import including_large_strain, press_grid
from papilla.fem.pressing.large_strain import is_known, known, large_strain_error
from papilla.fem.pressing.press import CONTACT_MEASURES
from papilla.fem.reduction.reduced import needs_reduced
from papilla.mesh.scale import FingerScale, rounded
from papilla.model.finger import Finger
from papilla.model.specimen import STICK_WORD, Friction, Specimen, friction_coefficient, physics_words

DEFAULT_MODULI = tuple(sorted((*np.geomspace(0.02, 5.0, 40).tolist(), *SPECIMENS_MPA)))
"""Moduli in MPa, the published ones among them. There are 43, because a contact grows node by node and a coarser table
would give visible errors of E."""
DEFAULT_FORCES = tuple(np.geomspace(0.05, 1.0, 60).tolist())
"""Forces in N."""
CHECKED_FORCE_N, CHECKED_MODULUS_MPA = (gf_to_newton(20.0), gf_to_newton(100.0)), (0.05, SPECIMENS_MPA[-1])
"""Forces and moduli over which a modulus should be recovered well: those of the papers."""
COMPACT_FORCE_N = (gf_to_newton(10.0), CHECKED_FORCE_N[1])
"""Forces of the compact form; its moduli are `CHECKED_MODULUS_MPA`."""
SHOWN_PRESS = (0.588, SPECIMENS_MPA[1])
"""Force (N) and modulus (MPa) of the press that is shown or compared: 60 gf on the middle one of the published
specimens."""
NUMBER_COLUMNS = ("force_N", "modulus_MPa", "sd_microstrain", "indentation_mm", "contact_area_mm2", "peak_pressure_MPa")
ARRAY_COLUMNS = (*NUMBER_COLUMNS, "specimen_error", "reading", "resolved")

NOT_INCLUDED = 0.018
"""Relative standard deviation of S_d if large strain is not included: it changes S_d by up to twice as much."""

ORIGIN_COLUMNS = ("finger_name", "finger_sha256", "mesh_sha256", "mesh_size_mm")


@dataclass(frozen=True)
class CalibrationRanges:
    """Forces (N) and moduli (MPa) of a calibration unless others are given: those above, times factors that follow from
    the finger's size and hardness (`FingerScale`)."""

    force_factor: float = 1.0
    modulus_factor: float = 1.0

    @classmethod
    def of(cls, finger: Finger) -> "CalibrationRanges":
        """The ranges of a finger; raises what `surfaces_of` raises."""
        scale = FingerScale.of(finger)
        return cls(rounded(scale.force), rounded(scale.modulus))

    @classmethod
    def recorded(cls, finger: Mapping[str, Any]) -> "CalibrationRanges":
        """The ranges that a calibration's record of its finger states; those of the default finger if it states
        none."""
        names = [entry.name for entry in fields(cls) if entry.name in finger]
        return cls(**{name: checks.positive(name, finger[name]) for name in names})

    def to_json(self) -> dict[str, float]:
        """What `recorded` reads: nothing for the default finger."""
        return {} if self == CalibrationRanges() else asdict(self)

    @property
    def forces(self) -> tuple[float, ...]:
        """Forces of a sweep."""
        return self.forced(DEFAULT_FORCES)

    @property
    def moduli(self) -> tuple[float, ...]:
        """Moduli of a sweep."""
        return self.hardened(DEFAULT_MODULI)

    def swept(
        self, forces: Sequence[float] | None, moduli: Sequence[float] | None
    ) -> tuple[Sequence[float], Sequence[float]]:
        """Forces and moduli of a sweep: those that are given, else the usual ones."""
        return self.forces if forces is None else forces, self.moduli if moduli is None else moduli

    @property
    def checked(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Ends of the forces and moduli over which a modulus should be recovered well."""
        return self.forced(CHECKED_FORCE_N), self.hardened(CHECKED_MODULUS_MPA)

    @property
    def checked_in_words(self) -> str:
        """`checked`, such as "20-100 gf and 0.05-0.72 MPa"."""
        forces, moduli = self.checked
        low, high = (f"{newton_to_gf(force):.3g}" for force in forces)
        return f"{low}-{high} gf and {moduli[0]:.3g}-{moduli[1]:.3g} MPa"

    @property
    def shown(self) -> tuple[float, float]:
        """Force and modulus of the press that is shown."""
        return self.force_factor * SHOWN_PRESS[0], self.modulus_factor * SHOWN_PRESS[1]

    def forced(self, forces: Sequence[float]) -> tuple[float, ...]:
        """Forces of the default finger as those of this one."""
        return tuple(self.force_factor * force for force in forces)

    def hardened(self, moduli: Sequence[float]) -> tuple[float, ...]:
        """Moduli of specimens of the default finger as those of this one."""
        return tuple(self.modulus_factor * modulus for modulus in moduli)


@dataclass(frozen=True, eq=False, repr=False)
class Sweep:
    """A labelled table of n presses, g gauges.

    Parameters
    ----------
    force_N, modulus_MPa : (n,).
    reading : (n, g) in microstrain; NaN if the press left the range of the model.
    sd_microstrain : (n,) population standard deviation (ddof 0) of the readings.
    indentation_mm, contact_area_mm2, peak_pressure_MPa : (n,).
    specimen_error : (n,) one sigma of ln S_d by the specimens' own large strain.
    resolved : (n,) bool, whether the mesh was fine enough.
    status : n sentences.
    gauge_names : g names.
    specimen : what was pressed, in words; friction : between it and the finger, a number or "stick".
    physics : what the presses include, in words.
    friction_told : whether the friction was stated.
    strain : relative standard deviation of S_d by large strain.
    finger_name, finger_sha256, mesh_sha256, mesh_size_mm : where it comes from.
    """

    force_N: np.ndarray
    modulus_MPa: np.ndarray
    reading: np.ndarray
    sd_microstrain: np.ndarray
    indentation_mm: np.ndarray
    contact_area_mm2: np.ndarray
    peak_pressure_MPa: np.ndarray
    specimen_error: np.ndarray
    resolved: np.ndarray
    status: tuple[str, ...]
    gauge_names: tuple[str, ...]
    specimen: str = ""
    friction: float | str = 0.0
    physics: str = ""
    friction_told: bool = True
    strain: float = 0.0
    finger_name: str = ""
    finger_sha256: str = ""
    mesh_sha256: str = ""
    mesh_size_mm: float = float("nan")

    def __len__(self) -> int:
        return len(self.force_N)

    def __repr__(self) -> str:
        force, modulus = (f"{values.min():g}-{values.max():g}" for values in (self.force_N, self.modulus_MPa))
        under = f"; {self.physics}" if self.physics else ""
        return f"<Sweep of {self.finger_name or 'a finger'}: {len(self)} presses, {force} N, {modulus} MPa{under}>"

    @property
    def valid(self) -> np.ndarray:
        """(n,) bool: rows that contain readings."""
        return np.isfinite(self.sd_microstrain) & np.isfinite(self.reading).all(axis=1)

    def to_csv(self, path: str | Path) -> None:
        """Write sweep.csv: force_N, modulus_MPa, g1, ..., sd_microstrain, indentation_mm, ..., status; atomically.

        Gauge columns are g1, g2, ... in the order of the gauges. Raises `FileAccessError`.
        """
        write_table(path, self.columns())

    def columns(self) -> dict[str, Sequence | np.ndarray]:
        """Name -> column (n,), in the order of sweep.csv."""
        gauges = {f"g{number}": column for number, column in enumerate(self.reading.T, start=1)}
        first, rest = (
            {name: getattr(self, name) for name in names} for names in (NUMBER_COLUMNS[:2], NUMBER_COLUMNS[2:])
        )
        return first | gauges | rest | {"resolved": self.resolved.astype(int), "status": self.status}

    def to_frame(self) -> Any:
        """The columns of sweep.csv as a pandas DataFrame; without pandas, a dict of columns that `pandas.DataFrame`
        accepts."""
        try:
            import pandas as pd
        except ImportError:
            return self.columns()
        return pd.DataFrame(self.columns())

    def _repr_html_(self) -> str:
        """S_d at five forces and five moduli as a table, for notebooks."""
        force, modulus = ((values := np.unique(of))[np.linspace(0, len(values) - 1, 5).round().astype(int)] for of in
                          (self.force_N, self.modulus_MPa))  # fmt: skip
        rows = []
        for f in np.unique(force).tolist():
            cells = [self.sd_microstrain[(self.force_N == f) & (self.modulus_MPa == e)] for e in np.unique(modulus)]
            rows.append([f"{f:.3g} N", *(float(cell[0]) if len(cell) else "" for cell in cells)])
        heads = ["S_d in microstrain", *(f"{e:.3g} MPa" for e in np.unique(modulus).tolist())]
        return html_table(repr(self).strip("<>"), rows, heads)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Everything as named arrays, as the cache keeps them."""
        arrays = {name: getattr(self, name) for name in ARRAY_COLUMNS}
        others = {item.name: getattr(self, item.name) for item in fields(self) if item.name not in arrays}
        return arrays | {"others": np.array(json.dumps(others))}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> "Sweep":
        """The sweep of `to_arrays`; raises `FileFormatError` for anything else."""
        try:
            others: dict[str, Any] = json_value(str(arrays["others"]), "others", finite=False)
            others["status"], others["gauge_names"] = tuple(others["status"]), tuple(others["gauge_names"])
            columns: dict[str, Any] = {name: arrays[name] for name in ARRAY_COLUMNS}
            table = cls(**columns, **others)
        except (KeyError, TypeError) as error:
            raise FileFormatError(f"a sweep is not complete: {error}") from error
        count = len(table.status)
        shapes = dict.fromkeys(columns, (count,)) | {"reading": (count, len(table.gauge_names))}
        wrong = [name for name, shape in shapes.items() if columns[name].shape != shape]
        if wrong:
            raise FileFormatError(f"a sweep of {count} presses has another number of values of {', '.join(wrong)}")
        return table


def sweep(
    reduced: ReducedFinger,
    moduli: Sequence[float] = DEFAULT_MODULI,
    forces: Sequence[float] = DEFAULT_FORCES,
    specimen: Specimen | Callable[[float], Specimen] | None = None,
    progress: Progress = silent,
    friction: Friction | None = None,
    large_strain: bool = True,
) -> Sweep:
    """Press specimens of each modulus (MPa) at each force (N).

    All presses have the fidelity `contact`, because a table that changed its fidelity midway would have a step. The
    change by large strain is included if it is known for the finger. A press outside the range of the model stays in
    the table with NaN, and its status states the reason.

    Parameters
    ----------
    specimen : makes the specimen of a modulus; or a specimen, whose modulus is replaced by each of `moduli`. None: the
        blocks of the finger's bench, 10 mm thick unless the design says otherwise.
    progress : told the presses done, and those in all.
    friction : 0, Coulomb's coefficient or "stick"; the force grows from first touch at each modulus. None takes that of
        the finger's bench; if the bench states none, stick if large strain is known with it, else 0.
    large_strain : False leaves it out.

    Raises `InputError` for moduli or forces that are not positive or occur twice, and what `press` raises otherwise.
    """
    needs_reduced(reduced)
    moduli, forces = _rising("modulus (MPa)", moduli), _rising("force (N)", forces)
    if isinstance(specimen, Specimen):
        specimens = [replace(specimen, modulus=modulus) for modulus in moduli]
    else:
        specimens = [(specimen or reduced.bench.specimen)(modulus) for modulus in moduli]
    friction = reduced.bench.friction if friction is None else friction
    friction_told = friction is not None
    if friction is None:
        friction = STICK_WORD if large_strain and is_known(reduced, math.inf) else 0.0
    rubbing, first = friction_coefficient(friction), specimens[0]
    large_strain = large_strain and is_known(reduced, rubbing) and first.curvature == (0.0, 0.0)
    rows: list[tuple] = []
    scenes = itertools.product(moduli, forces)
    for (modulus, force), (touched, pressed) in zip(
        scenes, press_grid(reduced, specimens, forces, friction), strict=True
    ):
        try:
            if isinstance(pressed, Exception):
                raise pressed
            pressed = corrected(reduced, touched, pressed) if large_strain else pressed
        except ContactRangeError as error:
            blank = [float("nan")] * len(reduced.gauge_names)
            rows.append((force, modulus, blank, *[float("nan")] * len(NUMBER_COLUMNS[2:]), 0.0, False, str(error)))
        else:
            measures = [getattr(pressed, name) for name in (*CONTACT_MEASURES, "specimen_error")]
            reading = pressed.reading.tolist()
            rows.append((force, modulus, reading, pressed.sd, *measures, pressed.resolved, pressed.status))
        progress(CountedStep("sweeping over force and modulus", len(rows), len(moduli) * len(forces)))
    *columns, status = zip(*rows, strict=True)
    names = (*NUMBER_COLUMNS[:2], "reading", *NUMBER_COLUMNS[2:], "specimen_error", "resolved")
    values: dict = dict(zip(names, map(np.array, columns), strict=True))
    return Sweep(
        **values,
        status=status,
        specimen=_in_words(first),
        friction=friction,
        physics=physics_words(first, rubbing, large_strain),
        friction_told=friction_told,
        strain=large_strain_error(reduced, rubbing) if large_strain else NOT_INCLUDED,
        **{name: getattr(reduced, name) for name in ("gauge_names", *ORIGIN_COLUMNS)},
    )


def cached_press(press: Callable[..., Press], reduced: ReducedFinger, specimen: Specimen, **scene: Any) -> Press:
    """What `press`, a function of papilla, makes of a scene; from the cache the second time, with the old seconds.

    The tables of large strain that are known for the finger are part of the key, because a press uses them.
    """

    def make() -> dict[str, np.ndarray]:
        pressed = press(reduced, specimen, **scene)
        values_by_name = {item.name: getattr(pressed, item.name) for item in fields(Press)}
        return {name: np.asarray(value) for name, value in values_by_name.items() if value is not None}

    tables = [table.to_json() for table in known(reduced.strain_key)]
    key = cache.key(press.__module__, press.__name__, reduced.to_arrays(), repr(specimen), scene, tables)
    values_by_name = cache.fetch("press", key, make)
    values: dict[str, Any] = {name: value if value.ndim else value.item() for name, value in values_by_name.items()}
    return Press(**values)


def corrected(reduced: ReducedFinger, specimen: Specimen, linear: Press) -> Press:
    """A linear press with the change by large strain; the same press if no table of it is known for the finger, or if
    the specimen is curved. Raises `ContactRangeError` outside of the table."""
    if not is_known(reduced, linear.friction) or specimen.curvature != (0.0, 0.0):
        return linear
    with_it = including_large_strain(reduced, specimen, linear)
    if with_it is None:
        raise ContactRangeError("large strain is not known here: the press is outside of the measured range")
    return with_it


def _rising(name: str, values: Sequence[float]) -> list[float]:
    """Positive values in rising order; raises `InputError` for none, or for one that occurs twice."""
    numbers = sorted(checks.positive(name, value) for value in values)
    if not numbers:
        raise InputError(f"a sweep needs at least one {name}")
    twice = [number for number, following in itertools.pairwise(numbers) if number == following]
    if twice:
        raise InputError(f"{name} {twice[0]:g} occurs twice in the sweep")
    return numbers


def _in_words(touched: Specimen) -> str:
    """The specimen without its modulus, such as "Block(thickness=10.0, nu=0.495)"."""
    others = [f"{item.name}={getattr(touched, item.name)}" for item in fields(touched) if item.name != "modulus"]
    return f"{type(touched).__name__}({', '.join(others)})"
