"""`miro://` among pyserial's own handlers, so that programs which know nothing of Mirotwin find it."""

from mirotwin.ports.serial_port import Serial as Serial
