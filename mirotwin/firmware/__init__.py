"""Firmware images: read, run on the bare processor, looked into (`mirotwin fw`)."""
