"""Problems that are solved on the spline."""
