"""Finite elements on a spline: vibration modes, statics, conduction.

Imports `spline` and the layers below.
"""
