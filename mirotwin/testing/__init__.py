"""For people's own tests: pytest's fixtures and files that are tests ([how](README.md))."""
