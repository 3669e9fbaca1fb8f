"""The report of a run: numbers, pictures, page.

Imports analysis, io and below; not the pipeline.
"""
