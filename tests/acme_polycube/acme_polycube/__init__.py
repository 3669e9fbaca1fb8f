"""Plugins of a third party; every module below is imported, and registers what it defines."""
