"""The map of the paper: segment the surface, flatten each patch, extend the map to the interior."""
