"""The content of `report.json`: measures of mesh, spline and solution.

Imports `io` and the layers below.
"""
