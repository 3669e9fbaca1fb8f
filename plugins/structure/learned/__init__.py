"""Propose polycubes with a trained network.

Imports the core, the slices and the labels.
"""
