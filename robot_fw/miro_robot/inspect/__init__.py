"""Looking into a running CPU: disassembly, trace, profile, coverage, waveforms (README.md).

What belongs here: everything that watches firmware at work and turns what it saw into text or records. What does
not: the CPU itself (`mcs51/`), which knows of all this only that an inspector may run it, and the command line
(`mirotwin.cli.fw_*`). Whoever watches changes no bit of what is watched.
"""
