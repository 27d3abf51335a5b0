"""Objectives of studies: one registered function per file; importing this package registers all of them.

They are imported by name, because the keys of stored records contain the code that is imported.
"""

from papilla.design.objectives import (  # noqa: F401
    force_at_depth,
    identifiable_share,
    largest_strain,
    sigma_force_depth,
    sigma_gauges,
    sigma_sd,
    signal_over_noise,
    specimens_told_apart,
    worst_over_tolerances,
)
from papilla.design.objectives.registry import OBJECTIVES as OBJECTIVES
from papilla.design.objectives.registry import Objective as Objective
from papilla.design.objectives.registry import objective as objective
