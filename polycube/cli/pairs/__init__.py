"""What is shown of the pairs that a diffusion model is trained on."""
