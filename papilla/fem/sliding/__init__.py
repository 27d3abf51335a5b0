"""Sliding over a textured surface: the section at y = 0, condensed once, then moved with stick and slip."""
