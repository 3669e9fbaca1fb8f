"""Ranking of proposed structures."""
