"""Train a denoiser, monitor the training, and evaluate the result.

Imports `diffusion` and the layers below; Lightning is imported only here and in `cli`.
"""
