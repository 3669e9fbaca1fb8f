"""From a surface to an analysed solid: run state, stages, search, acceptance, deadline.

Imports the registry and every folder below it; knows no plugin by name.
"""
