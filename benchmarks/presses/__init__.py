"""Presses of the same finger by papilla and by other libraries."""
