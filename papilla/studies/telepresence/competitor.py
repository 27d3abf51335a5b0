"""Parameters against a coded waveform at equal bytes: how near each is to the texture under the hand."""

from importlib.util import find_spec
from typing import NamedTuple

import numpy as np

from papilla.telepresence.codec import BLOCK, WaveformCodec, quality_for, spectral_snr_dB
from papilla.telepresence.direct import DirectFeedback
from papilla.telepresence.link import LinkModel
from papilla.telepresence.loop import RATE_HZ, Set, run
from papilla.telepresence.texture import GratingTexture


class CodedRow(NamedTuple):
    """One way to display: payload in bytes a second; spectral signal over noise in dB of what is displayed, against
    the texture under the hand; the same against the sensor's own signal, as if there were no delay; st_sim and spqi of
    vibromaf against the texture under the hand (None where that is not installed)."""

    name: str
    bytes_per_s: float
    under_hand_dB: float
    waveform_dB: float
    st_sim: float | None
    spqi: float | None


def parameters_against_waveform(
    parameters_Hz: float = 5.0,
    *,
    round_trip_ms: float = 120.0,
    wavelength_mm: float = 1.2,
    seconds: float = 6.0,
    seed: int = 0,
) -> list[CodedRow]:
    """The local model with this many messages a second, direct feedback, and a coder with the bytes of the first.

    Direct feedback's waveform is coded as it is displayed; a block adds its 64 ms to the delay.
    """
    way = LinkModel(one_way_ms=round_trip_ms / 2)
    texture = GratingTexture(wavelength_mm)
    record = run(Set(texture, seconds=seconds, uplink=way, downlink=way, parameters_Hz=parameters_Hz, seed=seed))
    scale = DirectFeedback().um_per_microstrain
    speed = np.gradient(record.hand_mm) * RATE_HZ
    ideal = scale * np.array([texture.reading(*row) for row in zip(record.hand_mm, speed, strict=True)])
    late = round(1e-3 * round_trip_ms * RATE_HZ)
    # What the sensor felt, at its own time: direct feedback before it was late.
    sensed = record.direct_um[late:]
    quality, cost = quality_for(sensed, record.bytes_per_s["local"])
    codec = WaveformCodec(quality)
    coded = codec.decode(codec.encode(sensed))[: sensed.size]
    shown = np.concatenate([np.zeros(late + BLOCK), coded])[: record.time_s.size]
    rows = record.judged
    ways = [
        ("local model", record.bytes_per_s["local"], record.local_um, record.local_um[: sensed.size]),
        ("direct feedback", record.bytes_per_s["direct"], record.direct_um, sensed),
        ("coded waveform", cost, shown, coded),
    ]
    return [
        CodedRow(
            name,
            spent,
            spectral_snr_dB(own[rows], ideal[rows]),
            spectral_snr_dB(aligned[rows], ideal[: sensed.size][rows]),
            *_vibromaf(own[rows], ideal[rows]),
        )
        for name, spent, own, aligned in ways
    ]


def _vibromaf(shown: np.ndarray, reference: np.ndarray) -> tuple[float | None, float | None]:
    """ST-SIM and SPQI of the package vibromaf, where it is installed."""
    if find_spec("vibromaf") is None:
        return None, None
    from vibromaf.metrics.spqi import spqi
    from vibromaf.metrics.stsim import st_sim

    similarity = st_sim(shown, reference)
    # Its power of a negative likeness is complex: less than nothing in common.
    return float(similarity) if np.isrealobj(similarity) else 0.0, float(spqi(shown, reference))
