"""The world: robots, networks and their order in time, built from a scenario."""
