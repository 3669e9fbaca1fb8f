"""Compare the meshes of a folder of CAD parts with published ones and with those of other commits.

It is a program for a checkout (`make bench`), and not a part of the package.
"""
