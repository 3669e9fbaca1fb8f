"""Train a denoiser, monitor the training, and evaluate the result."""
