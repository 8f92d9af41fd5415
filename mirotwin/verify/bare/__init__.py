"""Any firmware with a serial port on a bare processor: one run of it, checks in Python, and cases."""
