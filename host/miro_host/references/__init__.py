"""Reference trajectories: the interface (`interface`), and the paths, one in each module."""
