"""The pictures of `docs/theory`, and the page that follows one part through the search."""
