"""Readers of point clouds: PLY without faces, PCD and XYZ."""
