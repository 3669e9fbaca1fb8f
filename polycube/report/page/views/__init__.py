"""3D views of the pages: mesh, input and results; several results side by side."""
