"""The pyserial handler of `miro://`, for programs that register this package:

    serial.protocol_handler_packages.append("mirotwin.ports")

Other programs find it as `serial.urlhandler.protocol_miro`, which the installation puts beside pyserial's own handlers.
"""

from mirotwin.ports.serial_port import Serial as Serial
