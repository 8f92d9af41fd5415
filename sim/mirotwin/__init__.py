"""Mirotwin: what people do with the world, and the name they import.

Nothing is imported here, so that the program (`entry`) starts at once.
"""
