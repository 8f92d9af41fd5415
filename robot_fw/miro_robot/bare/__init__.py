"""A bare board for other people's programs: the CPU, external RAM, a terminal, and pins that a file moves."""
