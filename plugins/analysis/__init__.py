"""What is solved on the spline."""
