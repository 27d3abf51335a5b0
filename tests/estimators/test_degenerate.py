"""No column makes a pipeline raise: constant, zero, huge, tiny, missing, alternating, stuck and saturated channels."""

import numpy as np
import pytest

from papilla.estimators import Friction, Pipeline

ROWS = 1000
KINDS = ("constant", "zero", "huge", "tiny", "missing", "infinite", "alternating", "stuck", "steps", "sign", "patches")


def spoilt(rng, usual):
    """A column, as a broken channel shows it."""
    kind, size, number = rng.choice(KINDS), 10.0 ** rng.uniform(3, rng.choice([16, 308])), len(usual)
    column = usual.copy()
    if kind == "constant":
        column[:] = rng.choice(usual)
    elif kind == "zero":
        column[:] = 0.0
    elif kind == "huge":
        column *= size
    elif kind == "tiny":
        column *= 10.0 ** -rng.uniform(3, 320)
    elif kind == "missing":
        column[:] = np.nan
    elif kind == "infinite":
        column[rng.random(number) < 0.3] = rng.choice([np.inf, -np.inf])
    elif kind == "alternating":
        column = np.where(np.arange(number) % rng.integers(2, 50) == 0, rng.choice([0, -1, 1, size]), usual[0])
    elif kind == "stuck":
        column[: rng.integers(number)] = usual[0]
        column[rng.integers(number) :] = usual[-1]
    elif kind == "steps":
        column = np.repeat(usual[::100], 100)[:number]
    elif kind == "sign":
        column = np.sign(usual)
    else:
        for begin in range(0, number, 150):
            column[begin : begin + 150] = rng.choice([0.0, usual[begin], np.nan, size, -size, 1e-300])
    return column


def drawn(seed):
    """Columns, rate and rows of strokes over a grating; four channels in ten are broken."""
    rng = np.random.default_rng(seed)
    rate = float(rng.choice([1000, 250, 100]))
    time = np.arange(ROWS) / rate
    swing = np.sin(2 * np.pi * time / rng.uniform(0.2, 1.5))
    velocity = 10 ** rng.uniform(0, 2.5) * (np.where(swing > 0, 1.0, -1.0) if rng.random() < 0.5 else swing)
    place = np.cumsum(velocity) / rate
    force = 0.4 + 0.2 * np.sin(2 * np.pi * time / rng.uniform(0.3, 2)) * (rng.random() < 0.5)
    if rng.random() < 0.3:
        force = np.where(np.sin(2 * np.pi * time / rng.uniform(0.3, 1)) > 0, force, 0.0)
    columns = {
        "force_N": force,
        "velocity_mm_s": velocity,
        "position_mm": place,
        "tangential_N": 0.3 * force * np.sign(velocity) + 0.01,
    }
    names = tuple(name for name in columns if rng.random() < 0.8)
    gauges = [40 * np.sin(2 * np.pi * place / 1.2 + k) + 1000 * force * (k - 1) for k in range(5)]
    channels = []
    for column in (*gauges, *(columns[name] for name in names)):
        noise = rng.normal(0, 1e-3 * np.abs(column).max(), ROWS) * (rng.random() < 0.5)
        channels.append(spoilt(rng, column + noise) if rng.random() < 0.4 else column + noise)
    return names, rate, np.column_stack([time, *channels])


@pytest.mark.parametrize("seed", [*range(2), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 60))])
def test_broken_channels_never_stop_a_pipeline_and_blocks_answer_as_samples_do(calibration, seed):
    names, rate, rows = drawn(seed)
    single, whole = (Pipeline(calibration, columns=names, sample_rate_Hz=rate) for _ in range(2))
    answers, block = [single.update(row) for row in rows.tolist()], whole.process(rows)
    for name in type(block).__annotations__:
        column = getattr(block, name)
        column = column if isinstance(column, list) else column.tolist()
        assert repr([getattr(answer, name) for answer in answers]) == repr(column), name
    assert not np.isinf(np.concatenate([block.modulus_MPa, block.wavelength_mm, block.mu_kinetic])).any()


@pytest.mark.parametrize("tangential_N", [0.0, 0.15, -1e-200, 1e12])
@pytest.mark.parametrize("force_N", [0.5, 1e12])
def test_a_tangential_force_that_never_changes_shows_an_offset_and_no_friction(tangential_N, force_N):
    """To and fro, with a rest at each turn: turns and rests agree exactly, which is no certainty."""
    time = np.arange(4000) / 1000
    swing = np.sin(2 * np.pi * time / 0.8)
    velocity = 60 * np.sign(swing) * (np.abs(swing) > 0.3)
    rows = np.column_stack([np.full(4000, tangential_N), np.full(4000, force_N), velocity])
    answer = Friction().process(rows)
    assert not (np.abs(answer.mu_kinetic[-1000:]) > 4 * answer.mu_kinetic_sigma[-1000:]).any()
    assert (answer.offset_sigma_N[-1000:] > 1e-4).all()
    assert "ok" not in set(answer.sentence[-1000:])
