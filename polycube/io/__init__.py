"""Read surfaces, check them, write results."""
