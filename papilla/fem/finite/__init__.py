"""The fidelity `finite`: contact at finite strain with nearly incompressible hyperelastic layers, on the full
Taylor-Hood cell."""

from papilla.fem.finite.pressing import press_finite

__all__ = ["press_finite"]
