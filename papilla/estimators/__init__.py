"""Online estimators: `update(sample)` in a loop, `process(block)` over a log, `reset()` before something new.

Every name is imported on first use. `Pipeline` runs all estimators that the columns of a stream allow; `find_lines` is
for whole logs.
"""

from papilla.core._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
