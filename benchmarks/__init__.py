"""Comparisons and measurements of papilla, run from the root of the repository; they are not installed."""
