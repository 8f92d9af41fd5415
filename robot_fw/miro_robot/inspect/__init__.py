"""Looking into a running CPU: disassembly, trace, profile, coverage, waveforms (README.md).

What belongs here: everything that observes running firmware and turns the result into text or records. What does
not: the CPU itself (`mcs51/`), which knows of all this only that an inspector may run it, and the command line
(`mirotwin fw`). Watching changes no bit of a run.
"""
