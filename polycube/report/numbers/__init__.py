"""What `report.json` holds: measures of mesh, spline and solution.

Imports io and below.
"""
