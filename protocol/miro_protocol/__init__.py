"""The wire between host and robot: frames, CRC, sans-IO decoder, command streams. Imports nothing of ours."""

from miro_protocol import engine

engine.install()
