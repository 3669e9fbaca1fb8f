"""The content of `report.json`: measures of mesh, spline and solution."""
