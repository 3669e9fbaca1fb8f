"""From a surface to an analysed solid: run state, stages, search, acceptance, deadline.

Imports the registry and all layers below; does not depend on the names of plugins.
"""
