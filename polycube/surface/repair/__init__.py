"""Turn the triangles of a file into a closed, oriented surface, and report the changes."""
