"""When a hex mesh is valid, and which of two is better."""
