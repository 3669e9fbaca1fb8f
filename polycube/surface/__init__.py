"""Triangle surfaces: measures, frames, creases, closest points, intersections. No file access."""
