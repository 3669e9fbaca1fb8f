"""Unit cells that a polycube is put together from."""
