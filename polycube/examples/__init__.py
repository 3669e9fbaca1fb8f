"""Example parts, as implicit solids and their triangulations.

Imports `surface` and the layers below.
"""
