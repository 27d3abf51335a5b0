"""Closed forms of contact and layered elasticity, shared by tests, verification, documentation and fem (mm, N, MPa)."""

from papilla.references.halfspace import (
    boussinesq_displacement,
    boussinesq_strain,
    boussinesq_stress,
    uniform_disc_displacement,
    uniform_disc_mean_displacement,
)
from papilla.references.hertz import (
    HertzContact,
    composite_radius,
    effective_modulus,
    finite_sphere_factor,
    hertz_ellipse,
    hertz_ellipse_at,
    hertz_sphere,
    hertz_sphere_at,
    jkr_pull_off,
)
from papilla.references.kernel import BondedLayerKernel, bonded_layer_kernel
from papilla.references.layer import bonded_layer_deficit, bonded_layer_stiffness, halfspace_stiffness
from papilla.references.layer_sphere import BondedLayerContact, bonded_layer_sphere, bonded_layer_sphere_fit
from papilla.references.layered import StackLayer, layered_halfspace_stiffness
from papilla.references.solids import layered_sphere_displacement, neo_hookean_uniaxial, oedometric_modulus
from papilla.references.tangential import (
    BondedLayerGreen,
    bonded_layer_compliance,
    cerruti_displacement,
    halfspace_green,
)
from papilla.references.tangential_contact import (
    FrictionalPunch,
    dundurs_beta,
    frictional_punch,
    goodman_stick_radius,
    mindlin_displacement,
)

__all__ = [
    "BondedLayerContact",
    "BondedLayerKernel",
    "HertzContact",
    "StackLayer",
    "bonded_layer_deficit",
    "bonded_layer_kernel",
    "bonded_layer_sphere",
    "bonded_layer_sphere_fit",
    "bonded_layer_stiffness",
    "boussinesq_displacement",
    "boussinesq_strain",
    "boussinesq_stress",
    "composite_radius",
    "effective_modulus",
    "finite_sphere_factor",
    "halfspace_stiffness",
    "hertz_ellipse",
    "hertz_ellipse_at",
    "hertz_sphere",
    "hertz_sphere_at",
    "jkr_pull_off",
    "layered_halfspace_stiffness",
    "layered_sphere_displacement",
    "neo_hookean_uniaxial",
    "oedometric_modulus",
    "uniform_disc_displacement",
    "uniform_disc_mean_displacement",
    "BondedLayerGreen",
    "FrictionalPunch",
    "bonded_layer_compliance",
    "cerruti_displacement",
    "halfspace_green",
    "dundurs_beta",
    "frictional_punch",
    "goodman_stick_radius",
    "mindlin_displacement",
]
