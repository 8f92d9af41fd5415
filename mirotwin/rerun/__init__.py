"""A world made from what a file holds, and run again."""
