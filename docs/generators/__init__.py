"""Pages and pictures of the documentation that are made by programs.

These modules are for a checkout: they use the program, and are not a part of it.
"""
