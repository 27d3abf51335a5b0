"""A made-up finger whose S_d is known in closed form: smooth, rising with the modulus, saturating above 0.1 MPa."""

import numpy as np

from papilla.calibration import Sweep

PATTERN = np.array([-0.9, -0.4, 1.7, -0.6, -0.3])


def true_sd(force_N, modulus_MPa):
    """S_d in microstrain: a power of the force times a power of E / (E + E0(f))."""
    knee = 0.15 * (force_N / 0.3) ** 0.25
    return 45000 * force_N**0.6 * (modulus_MPa / (modulus_MPa + knee)) ** 0.4


def true_readings(force_N, modulus_MPa):
    """(..., 5) readings whose population standard deviation is `true_sd`, with a common part that is not zero."""
    sd = np.asarray(true_sd(force_N, modulus_MPa))[..., None]
    return sd * ((PATTERN - PATTERN.mean()) / PATTERN.std() - 0.2)


def make_sweep(moduli, forces, change=lambda force, modulus: 1.0, **values):
    """A sweep of the made-up finger; `change` multiplies its readings."""
    modulus, force = (part.ravel() for part in np.meshgrid(moduli, forces, indexing="ij"))
    reading = true_readings(force, modulus) * np.broadcast_to(change(force, modulus), force.shape)[:, None]
    columns = {
        "force_N": force,
        "modulus_MPa": modulus,
        "reading": reading,
        "sd_microstrain": reading.std(axis=1),
        "indentation_mm": force**0.7,
        "contact_area_mm2": 100 * force**0.7,
        "peak_pressure_MPa": 0.02 * force**0.3,
        "specimen_error": np.zeros(len(force)),
        "resolved": np.ones(len(force), bool),
        "status": ("made up",) * len(force),
        "gauge_names": ("g1", "g2", "g3", "g4", "g5"),
        "specimen": "Block(thickness=10.0, nu=0.495)",
        "finger_name": "made up",
        "finger_sha256": "0" * 64,
        "mesh_sha256": "1" * 64,
        "mesh_size_mm": 1.0,
    }
    return Sweep(**(columns | values))
