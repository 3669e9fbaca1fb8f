"""Propose polycubes with a trained network."""
