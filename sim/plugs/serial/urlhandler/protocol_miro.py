"""`miro://` among pyserial's own handlers, so that programs which know nothing of Mirotwin find it.

What belongs here: the name `Serial`. What does not: the class (`mirotwin.ports.serial_port`). pyserial looks for the
module `serial.urlhandler.protocol_NAME` when a URL `NAME://` is opened, and not before: an installation puts this file
there, and no other program pays for it.
"""

from mirotwin.ports.serial_port import Serial as Serial
