"""Isotropic linear elasticity: constants of a layer, and element matrices by batched products of basis gradients.

Element matrices come in 3 x 3 blocks, one for each pair of nodes of a cell.
"""

from collections.abc import Iterator

import numpy as np

from papilla.finger import Layer

LARGEST_COMPRESSIBILITY = 1e10
"""Of mu/lambda: where nu = 0 there is no pressure at all, and this leaves 1e-10 of it."""

CHUNK = 1024
"""Cells whose element matrices are made at once: they stay in the processor's cache."""


def lame(layer: Layer) -> tuple[float, float]:
    """Shear modulus mu (MPa) and compressibility 1/lambda (1/MPa, zero for nu = 0.5) of a layer."""
    mu = layer.modulus / (2 * (1 + layer.nu))
    ratio = (1 - 2 * layer.nu) / (2 * layer.nu) if layer.nu > 0 else LARGEST_COMPRESSIBILITY
    return mu, min(ratio, LARGEST_COMPRESSIBILITY) / mu


def shear_blocks(gradients: np.ndarray, weights: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Element blocks (m, k, 9) of the form 2 eps(u) : eps(v).

    gradients : (m, a, 3, q) of the scalar basis functions at quadrature points of `weights` (m, q).
    pairs : (2, k) local numbers of test and trial function.
    """
    result = np.empty((len(weights), pairs.shape[1], 3, 3))
    for part, products in _products(gradients, weights, pairs):
        result[part] = products.swapaxes(-1, -2)
        laplace = np.einsum("ekii->ek", products)
        for component in range(3):
            result[part, :, component, component] += laplace
    return result.reshape(*result.shape[:2], 9)


def volumetric_blocks(gradients: np.ndarray, weights: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Element blocks (m, k, 9) of the form div u div v; arguments as for `shear_blocks`."""
    result = np.empty((len(weights), pairs.shape[1], 3, 3))
    for part, products in _products(gradients, weights, pairs):
        result[part] = products
    return result.reshape(*result.shape[:2], 9)


def _products(gradients, weights, pairs) -> Iterator[tuple[slice, np.ndarray]]:
    """Cells, and integrals (cells, k, 3, 3) of the derivative along i of test times that along j of trial function."""
    cells, nodes, _, points = gradients.shape
    for first in range(0, cells, CHUNK):
        part = slice(first, min(first + CHUNK, cells))
        flat = gradients[part].reshape(-1, 3 * nodes, points)
        all_pairs = np.matmul(flat * weights[part, None, :], flat.transpose(0, 2, 1))
        # Indexed by pair first: an index array on both sides of a slice goes in front
        chosen = all_pairs.reshape(-1, nodes, 3, nodes, 3)[:, pairs[0], :, pairs[1], :]
        yield part, chosen.transpose(1, 0, 2, 3)
