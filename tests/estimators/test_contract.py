"""What every estimator promises: chunks change no bit, a reset forgets, a state goes on, any number type, no growth."""

import copy
import importlib
import inspect
import itertools
import pickle
import pkgutil

import numpy as np
import pytest

import papilla.estimators
from papilla.core.errors import InputError
from papilla.estimators import (
    ChirpTracker,
    Friction,
    FusedTracker,
    GaugeSoftness,
    LineTracker,
    Pipeline,
    Softness,
    SpaceTracker,
)
from papilla_papers import methods
from papilla_papers.methods import (
    CrossRidge,
    ImpulseDensity,
    ImpulseInterval,
    Okamoto,
    PrintedSoftness,
    ShortTimeSpectrum,
    ZeroCrossing,
)

ROWS = 900
RATE = 1000.0


def stream(seed: int, columns: str, pressed) -> np.ndarray:
    """Random rows of these columns: readings (g), force (f), tangential (t), velocity (v), position (x), time (T).

    pressed : force (n,) -> readings (n, 5) of a press.

    A grating of 1.2 mm under noise, with bursts of NaN, an infinity, a rest and a turn.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(ROWS) / RATE
    velocity = np.where(time < 0.6, 80.0, -60.0) * (1 + 0.05 * np.sin(9 * time))
    velocity[700:720] = 0.0
    place = np.cumsum(velocity) / RATE
    force = 0.4 + 0.2 * np.sin(5 * time)
    press = iter(pressed(force).T)
    made = []
    for number, kind in enumerate(columns):
        if kind == "g":
            texture = np.sin(2 * np.pi * (place - 2.0 * number) / 1.2) + rng.normal(0, 0.2, ROWS)
            values = next(press) + 20 * texture
        elif kind == "t":
            values = 0.6 * force * np.sign(velocity) + rng.normal(0, 0.01, ROWS)
        else:
            values = {"f": force + rng.normal(0, 1e-3, ROWS), "v": velocity, "x": place, "T": 36_000 + time}[
                kind
            ].copy()
        if kind != "T":
            begin = 150 + 40 * number
            values[begin : begin + 12] = np.nan
            values[500 + number] = np.inf
        made.append(values)
    return np.column_stack(made)


CASES = {
    "PrintedSoftness": (lambda c: PrintedSoftness(c, form="quadratic", gauge_sigma=2.0, force_sigma_N=1e-3), "gggggf"),
    "PrintedSoftness-printed": (lambda c: PrintedSoftness(c, gauge_sigma=2.0, force_sigma_N=1e-3), "gggggf"),
    "Softness": (lambda c: Softness(c, gauge_sigma=2.0, force_sigma_N=1e-3), "gggggf"),
    "GaugeSoftness": (lambda c: GaugeSoftness(c, gauge_sigma=400.0, force_sigma_N=1e-3), "gggggf"),
    "Friction": (lambda c: Friction(), "tfv"),
    "SpaceTracker": (lambda c: SpaceTracker(), "gv"),
    "FusedTracker": (lambda c: FusedTracker((0.0, 2.0, 5.0)), "gggv"),
    "ChirpTracker": (lambda c: ChirpTracker(), "gv"),
    "CrossRidge": (lambda c: CrossRidge(), "gg"),
    "LineTracker": (lambda c: LineTracker(2, wavelength_range_mm=(1.0, 6.0)), "ggx"),
    "Pipeline": (lambda c: Pipeline(c), "Tgggggfvt"),
    **{
        f"{kind.__name__}-{variant}": (lambda c, kind=kind, variant=variant: kind(variant=variant), "gvT")
        for kind in (ImpulseDensity, ImpulseInterval, Okamoto, ShortTimeSpectrum, ZeroCrossing)
        for variant in ("as_printed", "corrected")
    },
    "Pipeline-positions": (
        lambda c: Pipeline(None, gauges=3, columns=("force_N", "position_mm", "tangential_N")),
        "Tgggfxt",
    ),
    "Pipeline-slow": (
        lambda c: Pipeline(
            None, gauges=2, columns=("velocity_mm_s",), sample_rate_Hz=100.0, wavelength_range_mm=(1.0, 6.0)
        ),
        "Tggv",
    ),
    "Pipeline-blind": (lambda c: Pipeline(None, gauges=3, columns=()), "Tggg"),
}


COPIES = (copy.copy, copy.deepcopy, lambda estimator: pickle.loads(pickle.dumps(estimator)))
every = pytest.mark.parametrize("name", CASES)
LIGHT = (
    "Softness GaugeSoftness Friction SpaceTracker FusedTracker ChirpTracker LineTracker Pipeline-slow Pipeline-blind"
)
quickly = pytest.mark.parametrize(
    "name", [name if name in LIGHT.split() else pytest.param(name, marks=pytest.mark.slow) for name in CASES]
)
"""The whole pipeline and the methods of papers take longer."""


@pytest.fixture
def case(name, calibration, touch):
    """make() and rows(seed) of one case."""
    build, columns = CASES[name]

    def pressed(force):
        if name == "GaugeSoftness":
            return np.column_stack([gauge.reading(force, 0.3) for gauge in calibration.gauges])
        # A press is far greater than a texture: only what needs one gets it.
        return touch(0.3, force)[:, :-1] * ("f" in columns)

    return lambda: build(calibration), lambda seed=0: stream(seed, columns, pressed)


def same(first, second) -> bool:
    """Whether two answers of blocks are alike bit for bit."""
    for a, b in zip(first, second, strict=True):
        if isinstance(a, np.ndarray):
            if not np.array_equal(a, b, equal_nan=a.dtype.kind == "f"):
                return False
        elif a != b:
            return False
    return True


def joined(answers) -> list:
    """The answers of blocks as one; what is no column must be the same in all."""
    columns = []
    for values in zip(*answers, strict=True):
        if isinstance(values[0], np.ndarray):
            columns.append(np.concatenate(values))
        elif isinstance(values[0], list):
            columns.append([entry for value in values for entry in value])
        else:
            assert len(set(values)) == 1
            columns.append(values[0])
    return columns


def one_by_one(estimator, rows, whole) -> list:
    """Answers of `update`, in the form of those of a block."""
    columns = []
    for values, block in zip(zip(*map(estimator.update, rows), strict=True), whole, strict=True):
        if isinstance(block, np.ndarray):
            columns.append(np.array(values, block.dtype))
        else:
            columns.append(list(values) if isinstance(block, list) else values[0])
    return columns


def estimators() -> list[str]:
    """Names of all concrete public classes in both rooms of estimators with `process`, `update` and `reset`."""
    found = set()
    walks = (pkgutil.walk_packages(room.__path__, f"{room.__name__}.") for room in (papilla.estimators, methods))
    for module in itertools.chain(*walks):
        for name, value in vars(importlib.import_module(module.name)).items():
            if not inspect.isclass(value) or name.startswith("_") or inspect.isabstract(value):
                continue
            if all(callable(getattr(value, method, None)) for method in ("process", "update", "reset")):
                found.add(name)
    return sorted(found)


def test_every_estimator_has_a_case_and_every_case_an_estimator():
    assert {name.split("-")[0] for name in CASES} == set(estimators())
    assert set(estimators()) <= {*papilla.estimators.__all__, *methods.__all__}, "every one is a curated name"


@quickly
def test_chunks_and_single_samples_change_no_bit(case):
    make, rows = case
    rows = rows()
    whole, chunked = make().process(rows), make()
    numbers = [column for column in whole if isinstance(column, np.ndarray) and column.dtype.kind == "f"]
    assert any(np.isfinite(column).sum() > 100 for column in numbers), "a contract on silence proves nothing"
    parts = np.split(rows, [1, 2, 155, 156, 163, 509, 701, 702])
    assert same(joined([chunked.process(part) for part in parts]), whole)
    assert same(one_by_one(make(), rows.tolist(), whole), whole)


@pytest.mark.slow
@every
@pytest.mark.parametrize("kind", [np.float32, np.int32])
def test_single_precision_and_integer_samples_are_their_numbers(case, kind):
    make, rows = case
    table = np.nan_to_num(rows(), posinf=0).round().astype(kind) if kind is np.int32 else rows().astype(kind)
    whole = make().process(table.astype(float))
    assert same(make().process(table), whole)
    assert same(one_by_one(make(), list(table[:300]), whole), make().process(table[:300].astype(float)))


@quickly
def test_states_copies_and_a_reset_go_on_bit_for_bit_and_apart(case):
    """From the middle of a stream; what goes on elsewhere changes nothing here."""
    make, rows = case
    rows, first, used = rows(), make(), make()
    first.process(rows[:508])
    saved = pickle.dumps(first.state)
    used.process(rows[::-1])
    used.state = pickle.loads(saved)
    others = [used, *(copied(first) for copied in COPIES)]
    rest = first.process(rows[508:])
    assert all(same(other.process(rows[508:]), rest) for other in others)
    used.state = pickle.loads(saved)
    assert same(used.process(rows[508:]), rest), "a state that was handed out does not change later"
    used.reset()
    assert repr(used.state) == repr(make().state)
    assert same(used.process(rows[:300]), make().process(rows[:300]))


def size_after(estimator, rows: np.ndarray) -> int:
    """Bytes of the state after some rows."""
    estimator.process(rows)
    return len(pickle.dumps(estimator.state))


@pytest.mark.slow
@every
def test_the_state_does_not_grow(case, name):
    make, rows = case
    estimator = make()
    block = rows()
    sizes = []
    # Without a velocity a search under way holds its window as well, and ends: what is compared is the least
    blind = name in ("ChirpTracker", "Pipeline-blind")
    for number in range(4):
        later = block.copy()
        if isinstance(estimator, Pipeline):
            later[:, 0] += number * ROWS / RATE
        parts = np.array_split(later, 20) if blind else [later]
        sizes.append(min(size_after(estimator, part) for part in parts))
    # The chirp tracker holds a covariance of as many harmonics as it has just found
    assert sizes[3] <= (1.6 if blind else 1.02) * sizes[1] + 100


@every
def test_blocks_and_samples_of_another_width_are_refused(case):
    make, rows = case
    with pytest.raises(InputError, match="must be n "):
        make().process(np.zeros((3, 17)))
    with pytest.raises(InputError, match="must be"):
        make().update((1.0,) * 17)
    nothing = make().process(rows()[:0])
    assert all(len(column) == 0 for column in nothing if isinstance(column, np.ndarray | list))


@every
@pytest.mark.parametrize("size", [1e-300, 1e13, 1e160, 1e300])
def test_numbers_that_no_sensor_gives_end_in_a_status(case, size):
    make, rows = case
    wild = rows()[:400]
    wild[100:300:7] *= size
    for column in range(wild.shape[1]):
        wild[150 + 5 * column : 153 + 5 * column, column] = size
    whole = make().process(wild)
    assert all(len(column) == 400 for column in whole if isinstance(column, np.ndarray | list))
    numbers = [column for column in whole if isinstance(column, np.ndarray) and column.dtype.kind == "f"]
    assert not any(np.isinf(column).any() for column in numbers)
