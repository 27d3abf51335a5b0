"""Closed forms of contact and layered elasticity, used by tests, verification, documentation and fem (mm, N, MPa)."""

from papilla.references.halfspace import (
    StackLayer,
    boussinesq_displacement,
    halfspace_stiffness,
    layered_halfspace_stiffness,
    layered_surface_compliance,
    uniform_disc_mean_displacement,
)
from papilla.references.hertz import (
    HertzContact,
    effective_modulus,
    hertz_ellipse,
    hertz_ellipse_at,
    hertz_sphere,
    hertz_sphere_at,
)
from papilla.references.layer import BondedLayerGreen, LayerKernel, bonded_layer_deficit, sliding_layer_deficit
from papilla.references.layer_sphere import BondedLayerContact, bonded_layer_sphere
from papilla.references.tangential_contact import (
    FrictionalPunch,
    dundurs_beta,
    frictional_punch,
    goodman_stick_radius,
)
from papilla.references.two_spheres import SharedApproach, printed_area, printed_area_per_approach, shared_approach
from papilla.references.viscoelastic import Prony, lee_radok_force, lee_radok_indentation

__all__ = [
    "BondedLayerContact",
    "BondedLayerGreen",
    "FrictionalPunch",
    "HertzContact",
    "LayerKernel",
    "Prony",
    "SharedApproach",
    "StackLayer",
    "bonded_layer_deficit",
    "bonded_layer_sphere",
    "boussinesq_displacement",
    "dundurs_beta",
    "effective_modulus",
    "frictional_punch",
    "goodman_stick_radius",
    "halfspace_stiffness",
    "hertz_ellipse",
    "hertz_ellipse_at",
    "hertz_sphere",
    "hertz_sphere_at",
    "layered_halfspace_stiffness",
    "layered_surface_compliance",
    "lee_radok_force",
    "lee_radok_indentation",
    "printed_area",
    "printed_area_per_approach",
    "shared_approach",
    "sliding_layer_deficit",
    "uniform_disc_mean_displacement",
]
