"""Files that other libraries parse, in processes of their own with limits.

`process` starts them, `parsers` is one of them; those for CAD files lie beside this folder.
"""
