"""Assemblies of several solids: contacts, agreement of their meshes there, and a common mesh."""
