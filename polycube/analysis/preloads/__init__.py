"""Preloads, such as those of bolts."""
