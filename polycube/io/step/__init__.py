"""Information of a STEP file that Open CASCADE does not pass on with its shapes.

It reads the exchange structure of ISO 10303-21: the length unit, and names and groups of faces.
"""
