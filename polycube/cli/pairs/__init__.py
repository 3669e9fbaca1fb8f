"""Training pairs of a diffusion model from meshed parts."""
