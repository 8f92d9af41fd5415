"""Reference trajectories: their names (`registry`), the interface (`interface`), and the paths, one in each module."""
