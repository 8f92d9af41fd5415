"""Plugs for programs that know nothing of Mirotwin: `miro://` for pyserial, and PTY, TCP and RFC 2217 ports."""
