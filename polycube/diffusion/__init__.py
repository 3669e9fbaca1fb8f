"""The diffusion model: encoding, drift process, networks and weights."""
