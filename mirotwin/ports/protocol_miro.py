"""`miro://` where pyserial looks for it, for programs that name this package themselves:

    serial.protocol_handler_packages.append("mirotwin.ports")

Programs that know nothing of Mirotwin find the same through `serial.urlhandler.protocol_miro`, which an installation
puts beside pyserial's own handlers.
"""

from mirotwin.ports.serial_port import Serial as Serial
