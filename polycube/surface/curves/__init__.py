"""The curves of a surface: creases, borders of CAD faces, and where they end."""
