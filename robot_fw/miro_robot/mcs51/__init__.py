"""The AT89C52: CPU, ports, timers, serial port and interrupts, cycle by cycle as its data sheet has them."""
