"""The status of an estimate in words, for one sample and for a block."""

from collections.abc import Callable
from typing import Any

import numpy as np


def status_in_words(kind: Callable[[int], Any], status):
    """The sentence of a status, or, of an array (n,) of them, a list of n; `kind` is an enumeration with sentences."""
    if isinstance(status, np.ndarray):
        return [kind(code).sentence for code in status.tolist()]
    return kind(status).sentence
