"""Example parts as files, which `docs.generators.examples` writes."""
