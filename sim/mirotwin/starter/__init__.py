"""A sample project: the firmware of a robot with its tests. Its files are `examples/hil`, and in a wheel here."""
