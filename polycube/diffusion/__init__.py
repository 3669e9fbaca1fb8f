"""The diffusion model: encoding, drift process, networks, weights; only this layer imports torch."""
