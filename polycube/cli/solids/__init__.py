"""All solids of a CAD file: `infer.py mesh=assembly.step cad.solid=all`."""
