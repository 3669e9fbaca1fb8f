"""`report.html`: its sections, charts and 3-D view."""
