"""Finite elements on a spline: vibration modes, statics, conduction."""
