"""`mirotwin run`: a scenario, its files, its table and its viewers."""
