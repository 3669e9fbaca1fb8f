"""What is drawn off screen: scenes, their renderer, the denoising.

Imports io and below.
"""
