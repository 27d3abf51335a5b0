"""Rung `finite`: near-incompressible hyperelastic contact at finite strain, on the full Taylor-Hood cell."""

from papilla.fem.finite.pressing import press_finite

__all__ = ["press_finite"]
