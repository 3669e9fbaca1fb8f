"""The program as tools for other programs, by the Model Context Protocol: `polycube-mcp FOLDER`.

`server` has the tools, and `schemas` the types of their arguments.
"""
