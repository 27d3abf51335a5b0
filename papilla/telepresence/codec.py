"""A waveform coder to compare with: blocks of a cosine transform, quantised by what a finger feels, in real bytes.

In the spirit of the vibrotactile codecs of IEEE 1918.1.1 (wavelets, psychohaptic quantiser): plain on purpose. A block
waits until it is full, so it adds its own length to the delay.
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.fft import dct, idct

from papilla import checks
from papilla.errors import InputError

BLOCK = 64
"""Samples of a block."""


def threshold_dB(frequency_Hz) -> np.ndarray:
    """Level that is just felt, in dB: 62 (log10(f / 550 + 6 / 11) / log10(6 / 11))^2 - 77, least at 250 Hz.

    The absolute threshold of Noll et al. 2020 (IEEE Haptics Symposium, rate-scalable wavelet codec), as the package
    vibromaf has it; it ends where it reaches 0 dB.
    """
    level = 62 * (np.log10(np.asarray(frequency_Hz, float) / 550 + 6 / 11) / math.log10(6 / 11)) ** 2 - 77
    return np.minimum(level, 0.0)


class WaveformCodec:
    """Encoder and decoder of one signal.

    Parameters
    ----------
    quality_dB : how far the quantisation stays below the threshold's shape; 6 dB more is half the step.
    rate_Hz : of the samples.

    Raises `InputError` for values that are not usable.
    """

    def __init__(self, quality_dB: float, rate_Hz: float = 1000.0):
        frequency = np.arange(BLOCK) * checks.positive("rate_Hz", rate_Hz) / (2 * BLOCK)
        shape = 10 ** (0.05 * (threshold_dB(frequency) - threshold_dB(250.0)))
        self._steps = np.minimum(shape, 100.0) * 10 ** (-0.05 * checks.within("quality_dB", quality_dB, -200, 200))

    def encode(self, signal) -> list[bytes]:
        """The datagrams of a signal (n,), one a block; the last is filled with its last sample.

        Raises `InputError` for an empty signal or one that is not finite.
        """
        samples = np.asarray(signal, float)
        if samples.ndim != 1 or not samples.size or not np.isfinite(samples).all():
            raise InputError("a signal must be one column of finite samples")
        padded = np.pad(samples, (0, -samples.size % BLOCK), mode="edge").reshape(-1, BLOCK)
        levels = np.rint(dct(padded, norm="ortho") / self._steps).astype(int)
        return [_packed(block) for block in levels.tolist()]

    def decode(self, datagrams: Sequence[bytes | None]) -> np.ndarray:
        """The signal (n,) of datagrams; None, a lost one, is silence. Raises `InputError` for others."""
        blocks = [[0] * BLOCK if datagram is None else _unpacked(datagram) for datagram in datagrams]
        return idct(np.array(blocks) * self._steps, norm="ortho").ravel()


def _packed(levels: list[int]) -> bytes:
    """The number of levels up to the last that is not 0, and these, in Exp-Golomb code of order 0."""
    number = max((place + 1 for place, level in enumerate(levels) if level), default=0)
    # Signed to unsigned: 0, 1, -1, 2, -2 ... become 0, 1, 2, 3, 4 ...
    values = [number, *(2 * level - 1 if level > 0 else -2 * level for level in levels[:number])]
    bits = "".join("0" * ((value + 1).bit_length() - 1) + f"{value + 1:b}" for value in values)
    bits += "0" * (-len(bits) % 8)
    return int(bits, 2).to_bytes(len(bits) // 8, "big")


def _unpacked(datagram: bytes) -> list[int]:
    bits = f"{int.from_bytes(datagram, 'big'):0{8 * len(datagram)}b}" if datagram else ""
    place = 0
    values: list[int] = []
    while len(values) <= (values[0] if values else 0):
        one = bits.find("1", place)
        end = 2 * one - place + 1
        if one < 0 or end > len(bits):
            raise InputError("a datagram ends within a number: it is no block of this codec")
        values.append(int(bits[one:end], 2) - 1)
        place = end
        if values[0] > BLOCK:
            raise InputError(f"a block has {BLOCK} levels at most, a datagram says {values[0]}")
    levels = [(value + 1) // 2 if value % 2 else -(value // 2) for value in values[1:]]
    return levels + [0] * (BLOCK - len(levels))


def quality_for(signal, bytes_per_s: float, rate_Hz: float = 1000.0) -> tuple[float, float]:
    """(quality_dB, bytes a second) of the best coder whose blocks fit into so many bytes a second on the whole.

    Raises `InputError` where not even the coarsest does.
    """
    seconds = np.asarray(signal).size / rate_Hz
    low, high = -150.0, 150.0

    def cost(quality: float) -> float:
        return sum(map(len, WaveformCodec(quality, rate_Hz).encode(signal))) / seconds

    if cost(low) > bytes_per_s:
        raise InputError(f"{bytes_per_s:g} bytes/s are too few: the coarsest coder takes {cost(low):.3g}")
    while high - low > 0.1:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if cost(middle) <= bytes_per_s else (low, middle)
    return low, cost(low)


def spectral_snr_dB(shown, reference, block: int = 256) -> float:
    """Signal over noise of magnitude spectra, in dB: 10 log10(sum |R|^2 / sum (|R| - |D|)^2) over Hann blocks.

    Phases, which a finger does not compare, do not count. Both (n,), of one rate.
    """
    pair = [np.asarray(values, float) for values in (shown, reference)]
    number = min(values.size for values in pair) // block
    if number < 1:
        raise InputError(f"at least {block} samples are needed")
    windows = (values[: number * block].reshape(number, block) * np.hanning(block) for values in pair)
    given, wanted = (np.abs(np.fft.rfft(rows, axis=1)) for rows in windows)
    noise = float(((given - wanted) ** 2).sum())
    return 10 * math.log10(float((wanted**2).sum()) / noise) if noise > 0 else math.inf
