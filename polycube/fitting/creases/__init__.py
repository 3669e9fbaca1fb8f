"""Match edges of a hex mesh with the creases of a surface.

Imports `fitting` and the layers below.
"""
