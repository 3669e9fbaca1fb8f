"""Propose polycubes with a trained network.

Imports `polycube`, `slices` and `labels`.
"""
