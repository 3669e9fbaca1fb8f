"""Train a denoiser, follow the training, and evaluate what it learned.

Imports diffusion and below; Lightning is imported here and in cli only.
"""
