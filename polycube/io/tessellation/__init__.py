"""Parts of the worker process that tessellates CAD files with gmsh."""
