"""Two worlds run beside each other: the first tick, field, variable and instruction in which they differ."""
