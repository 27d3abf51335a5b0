"""Classification of textures by their spectrum over the path, at any speed; a window unlike all of them is unknown.

A window is cut by path, resampled in even steps of it, and each channel less the mean of all (hum, supply and net force
reach every gauge alike, a texture does not) gives the logarithm of its power in bands of wavelength. A linear
discriminant is trained with scikit-learn; a trained model is numbers that classify without it.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import AfterValidator, TypeAdapter, ValidationError

from papilla.core import checks
from papilla.core.errors import FileFormatError, InputError, MissingExtraError
from papilla.core.file_models import first_of, in_words, keys_of, table
from papilla.core.sealed import read_sealed, write_sealed
from papilla.estimators.spectral_bands import integral

TEXTURE_SCHEMA = "papilla.texture/1"
UNKNOWN_TEXTURE = "unknown"
KNOWN_WINDOW_SHARE = 0.98
"""Share of windows of known textures, from runs that were not trained on, that must not be called unknown."""
DISTANCE_LIMIT_MARGIN = 1.1
"""What the limit of the distance lies above that share, for there are few windows."""
NEAREST_NEIGHBOURS = 3


@dataclass(frozen=True)
class Features:
    """How windows become features: window_mm of path; bands, evenly spaced in the logarithm of the wavelength from
    shortest_mm to longest_mm, of each channel.

    Raises `InputError` for wavelengths that do not rise or do not fit the window twice, and fewer than two bands.
    """

    window_mm: float = 100.0
    shortest_mm: float = 1.0
    longest_mm: float = 50.0
    bands: int = 8

    def __post_init__(self):
        for name in ("window_mm", "shortest_mm", "longest_mm"):
            checks.positive(name, getattr(self, name))
        if not self.shortest_mm < self.longest_mm <= self.window_mm / 2:
            raise InputError(
                f"wavelengths must rise, the longest at most half of the window of {self.window_mm:g} mm, got "
                f"{self.shortest_mm:g} to {self.longest_mm:g} mm"
            )
        if self.bands < 2:
            raise InputError(f"bands must be at least 2, got {self.bands}")

    def of(self, position_mm, readings) -> np.ndarray:
        """(windows, bands x channels) features of a run: position (n,) and readings (n, channels); rows that are not
        finite, or no sensor gives, and rests, are left out; a window has no gap over half of the shortest wavelength.

        Raises `InputError` for a run without a whole window, and for steps too long for the shortest wavelength.
        """
        place, rows = (checks.believable(np.asarray(values, float)) for values in (position_mm, readings))
        if rows.ndim != 2 or place.shape != rows.shape[:1]:
            raise InputError(f"readings (n, channels) must fit position (n,), got {rows.shape} and {place.shape}")
        good = np.isfinite(place) & np.isfinite(rows).all(axis=1)
        place, rows, widest = place[good], rows[good], self.shortest_mm / 2
        steps = np.abs(np.diff(place))
        if steps.any() and (usual := float(np.median(steps[steps > 0]))) > widest:
            raise InputError(
                f"samples are {usual:.3g} mm apart: wavelengths of {self.shortest_mm:g} mm need half of that at most"
            )
        windows = [
            levels for stroke in _strokes(place, widest) for levels in self._windows(place[stroke], rows[stroke])
        ]
        if not windows:
            raise InputError(f"the run has no stroke of {self.window_mm:g} mm")
        return np.array(windows)

    def _windows(self, place: np.ndarray, rows: np.ndarray) -> list[np.ndarray]:
        step = self.shortest_mm / 4
        length = round(self.window_mm / step)
        even = np.arange(place[0], place[-1], step)
        if len(even) < length:
            return []
        if rows.shape[1] > 2:
            rows = rows - rows.mean(axis=1, keepdims=True)
        spaced = np.column_stack([np.interp(even, place, column) for column in rows.T])
        starts = range(0, len(even) - length + 1, length)
        return [self._levels(spaced[start : start + length], step) for start in starts]

    def _levels(self, window: np.ndarray, step: float) -> np.ndarray:
        """(bands x channels,) ln of the power per band, channel by channel."""
        from scipy.signal import detrend

        count = len(window)
        power = np.abs(np.fft.rfft(detrend(window, axis=0) * np.hanning(count)[:, None], axis=0)) ** 2
        edges = np.geomspace(1 / self.longest_mm, 1 / self.shortest_mm, self.bands + 1) * count * step
        return np.log(np.maximum(integral(power, edges) / np.diff(edges)[:, None], np.finfo(float).tiny)).T.ravel()


def _strokes(place: np.ndarray, widest: float) -> list[np.ndarray]:
    """Indices of the samples of each stroke, in the order of rising place. A stroke ends at a turn and at a step over
    `widest`; samples that do not move are left out."""
    steps = np.diff(place)
    moving = np.flatnonzero(steps)
    breaks = (np.diff(np.sign(steps[moving])) != 0) | (np.abs(steps[moving[:-1]]) > widest)
    parts = np.split(moving, np.flatnonzero(breaks) + 1)
    return [stroke if steps[stroke[0]] > 0 else stroke[::-1] for stroke in parts if len(stroke)]


@dataclass(frozen=True, eq=False)
class TextureModel:
    """A trained classifier: features, labels (k,), channels; centre and scale (d,) of the features, means (k, d) of the
    scaled ones and the precision (d, d) that they share; limit: squared distance beyond which a window is unknown.

    accuracy : of windows of runs that were left out of training, by this classifier and by nearest neighbours.
    """

    features: Features
    labels: tuple[str, ...]
    channels: int
    centre: np.ndarray
    scale: np.ndarray
    means: np.ndarray
    precision: np.ndarray
    limit: float
    accuracy: dict[str, float]

    def __post_init__(self) -> None:
        if not self.labels or not all(isinstance(label, str) for label in self.labels):
            raise InputError("labels must be names, one at least")
        length, count = np.size(self.centre), len(self.labels)
        expected = {"centre": (length,), "scale": (length,), "means": (count, length), "precision": (length, length)}
        for name, shape in expected.items():
            values = np.asarray(getattr(self, name))
            if values.shape != shape or not (np.abs(values) <= checks.LARGEST_READING).all():
                raise InputError(
                    f"{name} must be {shape} numbers of at most {checks.LARGEST_READING:g}, got {values.shape}"
                )
        if not (np.asarray(self.scale) > 0).all():
            raise InputError("scale must be greater than 0")
        if not isinstance(self.limit, float) or not self.limit > 0:
            raise InputError(f"limit must be greater than 0, got {self.limit!r}")

    def classify(self, position_mm: ArrayLike, readings: ArrayLike) -> tuple[list[str], np.ndarray]:
        """A label for each window of a run, or "unknown", and squared distances (windows, k) from the labels' means.

        Raises `InputError` for another number of channels and as `Features.of` does.
        """
        rows = np.asarray(readings, float)
        if rows.ndim != 2 or rows.shape[1] != self.channels:
            raise InputError(f"the model is of {self.channels} channels, got readings {rows.shape}")
        distances = self.distances(self.features.of(position_mm, rows))
        nearest = distances.argmin(axis=1)
        near_enough = distances.min(axis=1) <= self.limit
        return [
            self.labels[label] if ok else UNKNOWN_TEXTURE for label, ok in zip(nearest, near_enough, strict=True)
        ], distances

    def distances(self, features: np.ndarray) -> np.ndarray:
        """(windows, k) squared distances of features (windows, d)."""
        rest = ((features - self.centre) / self.scale)[:, None] - self.means
        return np.einsum("wkd,de,wke->wk", rest, self.precision, rest)

    def save(self, path: str | Path) -> None:
        """Write the model as JSON with a checksum, whole or not at all; raises `FileAccessError`."""
        values = {name: array.tolist() for name, array in vars(self).items() if isinstance(array, np.ndarray)}
        write_sealed({"schema": TEXTURE_SCHEMA} | vars(self) | {"features": asdict(self.features)} | values, Path(path))

    @classmethod
    def load(cls, path: str | Path) -> "TextureModel":
        """Read a model; raises `FileAccessError`, and `FileFormatError` for what is no model or was changed since."""
        document, file_note = read_sealed(Path(path), TEXTURE_SCHEMA, "texture model")
        if file_note:
            raise FileFormatError(f"{path}: {file_note}")
        try:
            model = _adapter().validate_python(document)
        except ValidationError as error:
            raise FileFormatError(f"{path} is no texture model: {in_words(first_of(error))}") from error
        if model.channels * model.features.bands != len(model.centre):
            problem = f"{model.channels} channels do not fit {len(model.centre)} features"
            raise FileFormatError(f"{path} is no texture model: {problem}")
        return model


@lru_cache(maxsize=1)
def _adapter() -> TypeAdapter[TextureModel]:
    """What a model file must hold."""
    vector: Any = Annotated[list[float], AfterValidator(np.array)]
    rows: Any = Annotated[list[list[float]], AfterValidator(np.array)]
    arrays: dict[str, Any] = {"centre": vector, "scale": vector, "means": rows, "precision": rows}
    return TypeAdapter(
        table(TextureModel, keys_of(TextureModel, features=table(Features, keys_of(Features)), **arrays))
    )


def train(runs: Sequence[tuple], *, features: Features | None = None) -> TextureModel:
    """A model from runs (label, group, position (n,), readings (n, channels)).

    group : a property that a run shares with others besides the texture, such as speed or repetition; accuracy and
    limit come from leaving out each group in turn, so there must be two groups with every label at least.
    Raises `InputError` for runs that do not fit, `MissingExtraError` without scikit-learn.
    """
    how = features or Features()
    if not runs:
        raise InputError("there are no runs to train on")
    tables = [how.of(position, readings) for _, _, position, readings in runs]
    table = np.concatenate(tables) if len({rows.shape[1] for rows in tables}) == 1 else None
    if table is None:
        raise InputError("all runs must have the same number of channels")
    labels = np.repeat([str(run[0]) for run in runs], [len(rows) for rows in tables])
    groups = np.repeat([str(run[1]) for run in runs], [len(rows) for rows in tables])
    names = tuple(np.unique(labels).tolist())
    if len(names) < 2 or UNKNOWN_TEXTURE in names:
        raise InputError(f"two labels at least, none of them {UNKNOWN_TEXTURE!r}, got {', '.join(names)}")
    for group in np.unique(groups):
        if len(np.unique(labels[groups != group])) < len(names):
            raise InputError(f"without group {group} some label has no run: every label needs two groups at least")
    model, distances = _fitted(how, names, table, labels), np.empty((len(table), len(names)))
    for group in np.unique(groups):
        out = groups == group
        distances[out] = _fitted(how, names, table[~out], labels[~out]).distances(table[out])
    answers = {"linear discriminant": np.array(names)[distances.argmin(axis=1)]}
    answers["nearest neighbours"] = _neighbours(table, labels, groups)
    accuracy = {name: float(np.mean(answer == labels)) for name, answer in answers.items()}
    channels = np.asarray(runs[0][3]).shape[1]
    limit = DISTANCE_LIMIT_MARGIN * float(np.quantile(distances.min(axis=1), KNOWN_WINDOW_SHARE))
    return replace(model, channels=channels, limit=limit, accuracy=accuracy)


def _fitted(how: Features, names: tuple[str, ...], table: np.ndarray, labels: np.ndarray) -> TextureModel:
    """Means and a shrunk common covariance (Ledoit and Wolf 2004, doi:10.1016/S0047-259X(03)00096-4)."""
    try:
        from sklearn.covariance import ledoit_wolf
    except ImportError as error:
        raise MissingExtraError(
            "a texture model needs scikit-learn; install it with: pip install 'papilla[texture]'"
        ) from error
    centre, scale = table.mean(axis=0), np.maximum(table.std(axis=0), 1e-9)
    scaled = (table - centre) / scale
    means = np.array([scaled[labels == name].mean(axis=0) for name in names])
    covariance, _ = ledoit_wolf(scaled - means[np.searchsorted(names, labels)], assume_centered=True)
    if not np.trace(covariance) > 0:
        raise InputError("one window of each label does not tell how windows differ: longer or more runs are needed")
    return TextureModel(how, names, 0, centre, scale, means, np.linalg.inv(covariance), math.inf, {})


def _neighbours(table: np.ndarray, labels: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Labels (windows,) that the nearest of the other groups' windows say."""
    from sklearn.model_selection import LeaveOneGroupOut, cross_val_predict
    from sklearn.neighbors import KNeighborsClassifier
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    fewest = len(table) - int(np.unique(groups, return_counts=True)[1].max())
    nearest = make_pipeline(StandardScaler(), KNeighborsClassifier(min(NEAREST_NEIGHBOURS, fewest)))
    return cross_val_predict(nearest, table, labels, groups=groups, cv=LeaveOneGroupOut())
