"""Steps: actions and waits during a run, from a scenario's `[[step]]` tables ([README](README.md)).

This package contains `keys` (the steps, and the frames of a host), `reading` (tables to steps, and whether a run can
reach them), `player` (executes them: frames, numbers, the stream) and `running` (a file with its verdict). The
conditions of waits are in `miro_sim.world.conditions`.
"""
