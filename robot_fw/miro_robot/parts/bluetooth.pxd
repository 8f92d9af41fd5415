from miro_robot.parts.wire_part cimport WirePart


cdef class BluetoothPart(WirePart):
    cdef readonly long long baud
    cdef public int connected
