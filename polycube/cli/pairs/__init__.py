"""Pairs that a diffusion model is trained on: made of parts that are meshed, and shown."""
