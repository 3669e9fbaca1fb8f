"""Resume a run: the stored results of its stages, and its settings."""
