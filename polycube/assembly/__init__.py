"""Assemblies of several solids: contacts, agreement of meshes there, common mesh and spline."""
