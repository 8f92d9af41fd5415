"""Looking into a running CPU: disassembly, trace, profile, coverage, waveforms; no bit of a run changes (README.md)."""
