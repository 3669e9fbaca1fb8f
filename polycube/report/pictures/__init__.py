"""Pictures: scenes, their off-screen renderer, the denoising.

Imports `io` and the layers below.
"""
