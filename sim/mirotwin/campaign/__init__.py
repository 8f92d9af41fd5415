"""Many runs: what a run is made from, the row of figures that it leaves, and the processes that make the rows."""
