"""Example parts as files, which `docs.generators.examples` writes.

Imports `types` and `errors`.
"""
