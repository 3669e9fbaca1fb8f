"""A local page at which a person sets up, starts and compares runs: `polycube-desk part.step`.

`job` states what is set as the settings of `infer.py`, `polycube.cli.process` runs it, `access`
guards the page, and `page` and `part` show it.
"""
