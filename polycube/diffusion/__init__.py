"""The diffusion model: encoding, drift process, networks, weights; only this layer imports torch.

Imports `structure`, `surface`, `io` and the layers below.
"""
