"""Generation of hex meshes from polycubes, with requested sizes, and by sheets of hexes."""
