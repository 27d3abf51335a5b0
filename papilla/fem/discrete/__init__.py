"""Discretisation: element spaces on a mesh, assembly and factorisation."""
