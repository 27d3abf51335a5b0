"""A page for trying: hand, grating, sliders for delay and loss, and the output of both displays; one file, no
network."""

import json
from os import PathLike
from typing import Any

from papilla.core.files import write_text
from papilla.core.outside import shipped
from papilla.telepresence.actuator import BAND_FADE_SHARE, PIEZO_STACK, Actuator, Safety
from papilla.telepresence.local_model import RAMP_S
from papilla.telepresence.motion import FASTEST_HAND_MM_S, WANDER_HZ, HandMotion

SETTINGS_MARK, STYLE_MARK = "/*SETTINGS*/{}", "/*STYLE*/"


def settings(
    motion: HandMotion,
    *,
    wavelength_mm: float,
    round_trip_ms: float,
    loss: float,
    amplitude_um: float,
    bytes_local: float,
    bytes_direct: float,
    actuator: Actuator = PIEZO_STACK,
) -> dict[str, Any]:
    """Initial values of the page, and the limits of its local model, which are those of `LocalModel`.

    bytes_local, bytes_direct : of one message. A hand at constant speed makes one stroke per second on the page.
    """
    safety, strokes = Safety(), motion.strokes_Hz or 1.0
    return {
        "wavelength_mm": wavelength_mm,
        "round_trip_ms": round_trip_ms,
        "loss": loss,
        "amplitude_um": min(amplitude_um, actuator.amplitude_um),
        "strokes_Hz": strokes,
        "wander": motion.wander,
        "wander_Hz": WANDER_HZ,
        "length_mm": HandMotion(motion.peak_mm_s, strokes).length_mm,
        "bytes_local": bytes_local,
        "bytes_direct": bytes_direct,
        "stroke": True,
        "cut": False,
        "slow": 1,
        "limits": {
            "band_Hz": actuator.band_Hz,
            "amplitude_um": actuator.amplitude_um,
            "fade": BAND_FADE_SHARE,
            "ramp_s": RAMP_S,
            "fastest_mm_s": FASTEST_HAND_MM_S,
            "hold_s": safety.hold_s,
            "decay_s": safety.decay_s,
            "attack_s": safety.attack_s,
        },
    }


def write_page(path: str | PathLike, begin: dict[str, Any]) -> None:
    """Write the page with these initial `settings`; raises `FileAccessError`."""
    text = shipped("papilla", "telepresence", "templates", "page.html")
    text = text.replace(STYLE_MARK, shipped("papilla", "data", "page.css"))
    write_text(path, text.replace(SETTINGS_MARK, json.dumps(begin).replace("</", "<\\/")))
