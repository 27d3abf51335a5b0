"""The papers behind papilla: their methods as printed, their claims and their figures.

This package imports papilla, never the reverse. Its commands and its methods of softness reach papilla by entry points.
"""
