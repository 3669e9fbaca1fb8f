"""Parts with bends: their path, and sheets and tubes unfolded and straightened."""
