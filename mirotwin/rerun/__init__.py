"""A world run from its first period to its last: once, or again from what a file holds."""
