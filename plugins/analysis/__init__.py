"""Analyses on the spline."""
