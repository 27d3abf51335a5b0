"""From a factorised finger to a `ReducedFinger`: contact patch, gauge rows, condensation."""
