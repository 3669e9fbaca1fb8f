"""The report of a run: numbers, pictures, page.

Imports `analysis`, `io` and the layers below, but not `pipeline`.
"""
