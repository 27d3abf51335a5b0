"""The spatial-ridge frequency of one gauge, the velocity being unknown: a chirp tracker that follows reversals."""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.status_words import status_in_words
from papilla.estimators.tracking import blind_filter, blind_kernel
from papilla.estimators.tracking.blind_search import LOOK_REMEMBERED, look_room, search_settings
from papilla.estimators.tracking.compiled import kernels, numba_available

HARMONICS = 5
PERIODS = 2.0
"""Of the lowest frequency, in the window of the bank."""
PROVED = 3.0
"""Periods: a lock that has followed fewer is not believed."""
FAINT_NATS = 10.0
"""Evidence of a line in the bank's window without which it is not believed: its 8 (chirp) x 50 (frequency) or so
independent places find as much in noise in 2 % of looks."""
PASS_BAND = 0.4
"""Harmonics above this fraction of the sampling rate are expected to have been removed by anti-aliasing."""
LONGEST_LAG_S = 0.03


@dataclass(frozen=True)
class TrackerState:
    """All that a tracker remembers: its arrays by name, flattened."""

    arrays: tuple[tuple[str, tuple[float, ...]], ...] = ()


class ChirpStatus(IntEnum):
    """What became of an answer; `sentence` says it in words."""

    OK = blind_kernel.OK
    SEARCHING = blind_kernel.SEARCHING
    QUIET = blind_kernel.QUIET
    MISSING = blind_kernel.MISSING

    @property
    def sentence(self) -> str:
        """The status in words."""
        return _SENTENCES[self]


_SENTENCES = {
    ChirpStatus.OK: "ok",
    ChirpStatus.SEARCHING: "no frequency stands out: the last one, if any, goes on in doubt, and its sigma grows",
    ChirpStatus.QUIET: "the reading does not change: standstill, or no texture",
    ChirpStatus.MISSING: "the reading is missing, not finite or saturated: the motion goes on as it was",
}


class ChirpEstimate(NamedTuple):
    """frequency_Hz and frequency_sigma_Hz, `lag_s` ago; wavelength_mm and wavelength_sigma_mm, NaN without a velocity;
    status (a `ChirpStatus` value). NaN before the first lock. Of a block, arrays (n,)."""

    frequency_Hz: float | np.ndarray
    frequency_sigma_Hz: float | np.ndarray
    wavelength_mm: float | np.ndarray
    wavelength_sigma_mm: float | np.ndarray
    status: int | np.ndarray

    @property
    def sentence(self):
        """The status in words: a string, or a list of them."""
        return status_in_words(ChirpStatus, self.status)


class ChirpTracker:
    """Streaming frequency of a periodic surface under one gauge; one sample is (reading,) or (reading, velocity_mm_s).

    The motion may be to and fro: the phase's rate keeps its sign through a reversal, so that the profile, which is
    learned, is read backwards. The model is a stroke of unknown and slowly changing stiffness, dw/dt = g,
    dg/dt = -k w + white noise; a constant speed is k = 0. How strong that noise is, and that of the offset, is learned
    from what the readings say of it (`blind_filter`), so that jerky motions widen the sigma, and steps of the offset
    pass.

    Bounds: `references.chirp_bound`. With a frequency that is a polynomial of time over a window, an answer at the
    window's end is several times worse than one a little before it. So the answer is that of `lag_s` ago, smoothed with
    all readings since. A velocity serves to tell the wavelength only, |v(t - lag)| / f; it is not used to find f. Close
    to a reversal, where the skin sticks while the finger turns, and while the lock is in doubt, the wavelength is held.
    The search for a lock is spread over samples (`blind_search`), so that no sample takes long.

    Parameters
    ----------
    frequency_range_Hz : (lowest, highest) frequency at which a lock may begin; a lock is then followed below, to zero.
        15 Hz to the lesser of 400 Hz and 0.4 sample_rate_Hz by default.
    sample_rate_Hz : of the samples, which are taken to be evenly spaced.
    lag_s : age of the answer, at most 0.03; rounded to whole samples. The default leaves a sample of a budget of 15 ms.
    saturation : |reading| from which a reading is not one.
    compiled : run the kernel compiled by numba (extra `fast`); by default where numba is installed.

    Raises `InputError` for unusable values, `MissingExtraError` when compiling is asked for without numba.
    """

    def __init__(
        self,
        *,
        frequency_range_Hz: tuple[float, float] | None = None,
        sample_rate_Hz: float = 1000.0,
        lag_s: float = 0.014,
        saturation: float = 1e12,
        compiled: bool | None = None,
    ):
        rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
        lowest, highest = _checked_range(frequency_range_Hz, rate)
        self.lag_s = round(checks.within("lag_s", lag_s, 0, LONGEST_LAG_S) * rate) / rate
        limit = checks.positive("saturation", saturation)
        motion = _filter_settings(rate, round(self.lag_s * rate))
        self._settings = blind_kernel.Settings(
            motion,
            search_settings(rate, lowest, highest, PERIODS, 14.0, motion),
            _guide_settings(rate, round(self.lag_s * rate), limit),
        )
        fast = numba_available() if compiled is None else compiled
        self._kernels = kernels(blind_kernel.COMPILED if fast else blind_kernel.KERNELS, fast)
        self._row, self._answer = np.full((1, 2), math.nan), np.empty((1, 5))
        self.reset()

    @property
    def state(self) -> TrackerState:
        """All that the tracker remembers, to be kept or to be set again."""
        return TrackerState(tuple((name, tuple(array.ravel().tolist())) for name, array in _remembered(self._memory)))

    @state.setter
    def state(self, state: TrackerState) -> None:
        fresh, given = _memory(self._settings, round(self.lag_s / self._settings.filter.dt)), dict(state.arrays)
        for name, array in _remembered(fresh) if state.arrays else ():
            flat, values = array.reshape(-1), given.get(name, ())
            if len(values) != flat.size:
                raise InputError(f"the state holds {len(values)} numbers of {name}, this tracker needs {flat.size}")
            flat[:] = values
        self._memory = fresh

    def reset(self) -> None:
        """Forget everything."""
        self.state = TrackerState()

    def process(self, block) -> ChirpEstimate:
        """Estimates after each row of a block (n,), (n, 1) or (n, 2); bit for bit what `update` gives row by row.

        Raises `InputError` for a block of another shape.
        """
        given = np.asarray(block, float)
        rows = given.reshape(-1, 1) if given.ndim == 1 else given
        if rows.ndim != 2 or rows.shape[1] not in (1, 2):
            shape = " x ".join(map(str, given.shape))
            raise InputError(f"a block must be n readings, or n x 2 (reading, velocity_mm_s), got {shape}")
        if rows.shape[1] == 1:
            rows = np.column_stack([rows, np.full(len(rows), math.nan)])
        answers = np.empty((len(rows), 5))
        self._kernels.track_block(self._settings, self._memory, np.ascontiguousarray(rows), answers)
        frequency, sigma, wavelength, wavelength_sigma = answers[:, :4].T.copy()
        return ChirpEstimate(frequency, sigma, wavelength, wavelength_sigma, answers[:, 4].astype(int))

    def update(self, sample) -> ChirpEstimate:
        """The estimate after one more sample: a reading, (reading,) or (reading, velocity_mm_s).

        Raises `InputError` for a sample of another length.
        """
        values = (sample,) if np.ndim(sample) == 0 else tuple(sample)
        if len(values) not in (1, 2):
            raise InputError(f"a sample must be a reading or (reading, velocity_mm_s), got {len(values)} values")
        self._row[0, 0], self._row[0, 1] = values[0], values[1] if len(values) == 2 else math.nan
        self._kernels.track_block(self._settings, self._memory, self._row, self._answer)
        frequency, sigma, wavelength, wavelength_sigma, status = self._answer[0].tolist()
        return ChirpEstimate(frequency, sigma, wavelength, wavelength_sigma, int(status))


def _checked_range(frequency_range_Hz, rate: float) -> tuple[float, float]:
    top = PASS_BAND * rate
    if frequency_range_Hz is None:
        frequency_range_Hz = (15.0, min(400.0, top))
    try:
        lowest, highest = frequency_range_Hz
    except (TypeError, ValueError):
        message = f"frequency_range_Hz must be two numbers (lowest, highest), got {frequency_range_Hz!r}"
        raise InputError(message) from None
    lowest = checks.positive("lowest frequency (Hz)", lowest)
    highest = checks.positive("highest frequency (Hz)", highest)
    if not 2 * lowest <= highest <= min(top, 100 * lowest):
        raise InputError(
            f"frequency_range_Hz must span a factor 2 to 100 below {PASS_BAND:g} of the sampling rate ({top:g} Hz), "
            f"got {lowest:g} to {highest:g} Hz"
        )
    return lowest, highest


def _filter_settings(rate: float, lag: int) -> blind_filter.FilterSettings:
    shape = np.concatenate([np.zeros(5), [1.0], np.repeat(1 / np.arange(2, HARMONICS + 1) ** 2, 2)]) / rate
    return blind_filter.FilterSettings(
        dt=1 / rate,
        harmonics=HARMONICS,
        band=2 * math.pi * PASS_BAND * rate,
        jerk=(0.3, 100.0, 5.0),
        wander=(0.05, 20.0),
        learn=(3.0 / rate, 60.0 / rate),
        doubled=(10.0, 20.0),
        memory=(math.exp(-1 / (0.03 * rate)), math.exp(-1 / (0.01 * rate))),
        stiffness=5.0,
        shape=shape,
        pressed=0.1,
        tail=(5e-4, 0.15),
        forget=1 / (0.3 * rate),
        alert=1 / (0.03 * rate),
        settled=0.1 * rate,
        least=3.0,
        start=60.0,
        floor=1e-8,
        every=max(math.ceil(lag / (blind_filter.PINS - 1)), 1),
    )


def _guide_settings(rate: float, lag: int, limit: float) -> blind_kernel.GuideSettings:
    return blind_kernel.GuideSettings(
        limit=limit,
        lag=float(lag),
        search=max(round(0.016 * rate), 1),
        doubt=max(round(0.032 * rate), 1),
        calm=2 * rate,
        young=0.5 * rate,
        surprised=1.7,
        noisy=6.0,
        pulled=3.0,
        coloured=0.4,
        loud=0.004,
        rival=8.0,
        lost=2.0,
        still=1 / (0.1 * rate),
        quiet=3.0,
        weak=0.25,
        hold=10.0,
        faint=FAINT_NATS,
        proved=2 * math.pi * PROVED,
        crawl=0.2,
        slow=(0.03, 5.0),
        vague=0.5,
        turn=0.25,
        worn=2.0,
    )


def _remembered(memory: blind_kernel.Memory) -> list[tuple[str, np.ndarray]]:
    own = [
        (name, getattr(memory, name)) for name in ("state", "cov", "track", "pins", "guide", "ring", "costs", "speeds")
    ]
    return own + [(name, getattr(memory.look, name)) for name in LOOK_REMEMBERED]


def _memory(settings: blind_kernel.Settings, delay: int) -> blind_kernel.Memory:
    size = 2 * settings.filter.harmonics + 4
    width, length = size + blind_filter.PINS, settings.search.window * settings.search.stride + settings.search.parts
    memory = blind_kernel.Memory(
        state=np.zeros(width),
        cov=np.zeros((size, width)),
        track=np.zeros(blind_filter.TRACK),
        pins=np.zeros(blind_filter.PINS),
        guide=np.zeros(blind_kernel.GUIDE),
        ring=np.full(length, math.nan),
        costs=np.full(length, math.nan),
        speeds=np.full(delay + 1, math.nan),
        look=look_room(settings.search, size),
        row=np.zeros(size),
        across=np.zeros(width),
    )
    memory.guide[blind_kernel.HELD] = memory.guide[blind_kernel.LENGTH] = math.nan
    return memory
