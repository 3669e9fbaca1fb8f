"""Removal of holes, fillets and faces from a CAD solid, before it is tessellated.

`options` are read by the program; `features` and `removing` run in the worker process of gmsh.
"""
