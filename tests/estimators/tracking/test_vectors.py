"""Each sum over small arrays in its two forms: NumPy calls, and loops for the compiler."""

import numpy as np
import pytest

from papilla.estimators.tracking import bank_kernel, bank_vectors, vectors
from papilla.estimators.tracking.compiled import kernel_cache
from papilla.estimators.tracking.tracker_kernel import KERNELS

RNG = np.random.default_rng(11)
SIZE = 2 * bank_kernel.FIT + 1
SPLIT, TURNS, MIXING = bank_kernel.bank_arrays(80)


def symmetric(size: int) -> np.ndarray:
    root = RNG.standard_normal((size, size))
    return root @ root.T + np.eye(size)


def add_waves(fields, keep, turn, value):
    bank_vectors.add_waves(TURNS, np.zeros((2, bank_vectors.SIDE)), fields, SPLIT, keep, turn, value)


def no_fields() -> np.ndarray:
    return np.zeros((2, bank_vectors.SIDE * (TURNS.size - bank_vectors.SIDE)))


def bank_fields() -> np.ndarray:
    fields = no_fields()
    for place in np.linspace(0, 5, 60):
        add_waves(fields, 0.97, 0.2 * place, np.cos(3 * place) + 0.3)
    return fields


def filter_state() -> np.ndarray:
    """The quadrature of the first harmonic is none: that is what the phase means."""
    state = RNG.standard_normal(14)
    state[9] = 0.0
    return state


def filter_row() -> np.ndarray:
    return np.concatenate([np.zeros(3), [1.0], RNG.standard_normal(10)])


CASES = {
    bank_vectors.add_waves: lambda: (
        TURNS,
        np.zeros((2, bank_vectors.SIDE)),
        bank_fields(),
        SPLIT,
        0.97,
        2.5,
        0.7,
    ),
    bank_vectors.explain: lambda: (bank_fields(), SPLIT, np.zeros(81)),
    bank_vectors.add_up: lambda: (RNG.random(40), 5, np.zeros(30)),
    bank_vectors.largest: lambda: (RNG.random(30), 4),
    bank_vectors.middle: lambda: (RNG.random(30),),
    bank_vectors.fade_into: lambda: (RNG.random(30), RNG.random(30), 0.9, 0.2),
    bank_vectors.normal_equations: lambda: (
        MIXING,
        bank_fields(),
        SPLIT,
        int(RNG.integers(5, 80)),
        np.zeros((SIZE, SIZE)),
        np.zeros(SIZE),
    ),
    vectors.harmonic_row: lambda: (np.arange(1.0, 6.0), filter_state(), 4, filter_row()),
    vectors.spread_row: lambda: (symmetric(14), filter_row(), np.zeros(14)),
    vectors.take_error: lambda: (RNG.standard_normal(14), symmetric(14), RNG.standard_normal(14), 3.0, 0.4),
    vectors.carry: lambda: (symmetric(14), RNG.random(14), 0.1, 0.3, -0.2),
}


@pytest.mark.parametrize("function", [item for item in vectors.LOOPS if item is not vectors.solve])
def test_both_forms_agree(function):
    given = CASES[function]()
    other = tuple(item.copy() if isinstance(item, np.ndarray) else item for item in given)
    first, second = function(*given), vectors.LOOPS[function](*other)
    scratch = 1 if function is bank_vectors.add_waves else None
    if function is vectors.harmonic_row:
        # The harmonic that is not present takes no part; both forms leave its entries zero.
        assert other[3][4 + 4] == given[3][4 + 4] == 0.0
    if first is not None:
        assert first == pytest.approx(second, rel=1e-12)
    for number, (a, b) in enumerate(zip(given, other, strict=True)):
        if number != scratch and isinstance(a, np.ndarray):
            assert a == pytest.approx(b, rel=1e-10, abs=1e-10)


def test_both_forms_solve_the_leading_equations():
    gram, right = symmetric(SIZE), RNG.standard_normal(SIZE)
    first, second = np.zeros(SIZE), np.zeros(SIZE)
    energy = vectors.solve(gram.copy(), right, 5, first)
    assert vectors.solve_loop(gram.copy(), right, 5, second) == pytest.approx(energy, rel=1e-12)
    assert first == pytest.approx(second, rel=1e-10)
    assert gram[:5, :5] @ first[:5] == pytest.approx(right[:5], rel=1e-10)
    assert not first[5:].any()


def test_normal_equations_are_those_of_the_samples():
    places, index, step = np.linspace(0, 5, 80), 9, 0.2
    readings = np.cos(2 * places) + 0.2
    fields = no_fields()
    for place, reading in zip(places, readings, strict=True):
        add_waves(fields, 1.0, step * place, reading)
    gram, right = np.zeros((SIZE, SIZE)), np.zeros(SIZE)
    bank_vectors.normal_equations(MIXING, fields, SPLIT, index, gram, right)
    phase = step * index * places
    waves = [wave(h * phase) for h in range(1, bank_kernel.FIT + 1) for wave in (np.cos, np.sin)]
    basis = np.column_stack([np.ones(80), *waves])
    ridge = bank_vectors.RIDGE * 80 * np.diag([0.0] + [1.0] * (SIZE - 1))
    assert gram == pytest.approx(basis.T @ basis + ridge, abs=1e-9)
    assert right == pytest.approx(basis.T @ readings, abs=1e-9)


def test_the_kernel_cache_follows_the_environment(monkeypatch, tmp_path):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "papilla"))
    ours = kernel_cache(KERNELS)
    assert ours.parent == tmp_path / "papilla" / "kernels"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    assert kernel_cache(KERNELS) == tmp_path / "numba" / "kernels" / ours.name
