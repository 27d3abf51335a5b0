"""The content of a spectrum in bands."""

import numpy as np


def integral(lines: np.ndarray, edges) -> np.ndarray:
    """Integral (b, ...) of lines (n, ...), each a rectangle of width 1 around its number, between edges (b + 1,)."""
    # The first line, at 0 Hz, has half of its width.
    borders = np.append(0.0, np.arange(len(lines)) + 0.5)
    widths = np.diff(borders).reshape(-1, *[1] * (lines.ndim - 1))
    sums = np.concatenate([np.zeros((1, *lines.shape[1:])), np.cumsum(lines * widths, axis=0)])
    at_edges = np.apply_along_axis(lambda column: np.interp(edges, borders, column), 0, sums)
    return np.diff(at_edges, axis=0)
