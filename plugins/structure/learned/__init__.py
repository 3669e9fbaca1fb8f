"""Propose polycubes with a trained network.

Imports the core and the slices.
"""
