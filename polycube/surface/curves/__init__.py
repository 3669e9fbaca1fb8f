"""The curves of a surface: creases, borders of CAD faces, and their end points."""
