"""Ranking of proposed structures.

Imports `polycube` only.
"""
