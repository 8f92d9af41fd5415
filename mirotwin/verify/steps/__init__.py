"""Steps: what is done and waited for during a run, as a scenario's `[[step]]` tables say it ([README](README.md)).

What belongs here: `keys` (the steps, and what a host may say), `reading` (tables to steps, and whether a run can
get there), `player` (doing it: frames, numbers, the stream) and `running` (a file with its verdict).
What a wait waits for is in `miro_sim.world.conditions`.
"""
