"""Live ports for other programs: `miro://` for pyserial, and PTY, TCP and RFC 2217 ports."""
