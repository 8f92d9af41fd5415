cdef class Bus:
    cpdef port_written(self, int port, int latch, long long tick)
    cpdef int movx_read(self, int address, long long tick) except -1
    cpdef movx_write(self, int address, int value, long long tick)
    cpdef fault(self, int kind, int pc, long long tick)
    cpdef receiver_on(self, long long tick)
    cpdef byte_received(self, int value, int stop, long long tick)
    cpdef byte_sent(self, int value, long long tick)
