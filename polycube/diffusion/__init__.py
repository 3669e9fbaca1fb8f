"""Encoding, drift process, network, data and training; the only place that knows torch."""
