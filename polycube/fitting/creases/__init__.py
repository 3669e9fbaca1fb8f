"""Match edges of a hex mesh with the creases of a surface."""
