"""The order in which proposed structures are meshed.

Imports the core.
"""
