"""Place edges of a hex mesh on the creases of a surface.

Imports fitting and below.
"""
