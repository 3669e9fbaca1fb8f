"""Read surfaces, CAD files and hex meshes; write meshes, splines and solutions."""
