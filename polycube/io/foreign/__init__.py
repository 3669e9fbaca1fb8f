"""Files that other libraries parse, in processes of their own with limits.

`process` starts them, and `parsers` is one of them. Those for CAD files are in the parent folder.
"""
