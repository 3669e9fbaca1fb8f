"""Built-in plugins, one module per kind; the registry imports them by name."""
