"""The waveform coder: back as it was sent within its step, in the bytes that it says, and hostile bytes refused."""

import math
import random

import numpy as np
import pytest

from papilla.errors import InputError
from papilla.telepresence.codec import BLOCK, WaveformCodec, quality_for, spectral_snr_dB, threshold_dB

TIME = np.arange(2000) / 1000
SIGNAL = 10 * np.sin(2 * np.pi * 80 * TIME) + 2 * np.sin(2 * np.pi * 170 * TIME + 1)


def test_the_threshold_is_least_at_250_Hz_and_zero_at_its_ends():
    frequency = np.arange(0, 500)
    assert frequency[np.argmin(threshold_dB(frequency))] == 250
    assert threshold_dB(250.0) == pytest.approx(-77) and threshold_dB(0.0) == pytest.approx(-15)
    assert threshold_dB(5000.0) == 0


def test_more_quality_is_nearer_and_dearer():
    found = []
    for quality in (-10, 10, 30, 50):
        codec = WaveformCodec(quality)
        datagrams = codec.encode(SIGNAL)
        back = codec.decode(datagrams)[: SIGNAL.size]
        found.append((sum(map(len, datagrams)), float(np.std(back - SIGNAL))))
    sizes, errors = zip(*found, strict=True)
    assert list(sizes) == sorted(sizes) and list(errors) == sorted(errors, reverse=True)
    assert errors[-1] < 0.1


@pytest.mark.parametrize("bytes_per_s", [100, 400, 2000])
def test_a_budget_is_kept(bytes_per_s):
    quality, cost = quality_for(SIGNAL, bytes_per_s)
    assert cost <= bytes_per_s and cost > 0.5 * min(bytes_per_s, 1500)
    assert sum(map(len, WaveformCodec(quality).encode(SIGNAL))) / 2 == pytest.approx(cost)
    with pytest.raises(InputError, match="too few"):
        quality_for(SIGNAL, 1)


def test_silence_loss_and_any_length_are_fine():
    codec = WaveformCodec(20)
    assert codec.encode(np.zeros(BLOCK)) == [b"\x80"]
    datagrams = codec.encode(SIGNAL[:100])
    assert len(datagrams) == 2
    assert (codec.decode([None, datagrams[1]])[:BLOCK] == 0).all()
    for bad in (np.array([]), np.array([1.0, math.nan]), np.zeros((2, 2))):
        with pytest.raises(InputError):
            codec.encode(bad)


def test_hostile_bytes_are_refused_or_a_block():
    rng, codec, refused = random.Random(3), WaveformCodec(0), 0
    for _ in range(3000):
        try:
            assert codec.decode([rng.randbytes(rng.randrange(0, 60))]).shape == (BLOCK,)
        except InputError:
            refused += 1
    assert refused > 0


def test_spectral_snr_does_not_hear_phase():
    shifted = 10 * np.sin(2 * np.pi * 80 * TIME + 1.5)
    assert spectral_snr_dB(shifted, 10 * np.sin(2 * np.pi * 80 * TIME)) > 30
    assert spectral_snr_dB(SIGNAL, SIGNAL) == math.inf
    assert spectral_snr_dB(0.9 * SIGNAL, SIGNAL) == pytest.approx(20, abs=0.01)
    with pytest.raises(InputError):
        spectral_snr_dB([1.0], [1.0])
