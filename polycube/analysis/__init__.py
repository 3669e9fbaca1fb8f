"""Finite elements on a spline: modes, statics, conduction.

Imports spline and below.
"""
