cdef class Bus:
    cpdef port_written(self, int port, int latch, long long tick)
    cpdef int movx_read(self, int address, long long tick) except -1
    cpdef movx_write(self, int address, int value, long long tick)
    cpdef movx_without_strobe(self, int address, int write)
    cpdef int inner_read(self, int address) except -1
    cpdef inner_write(self, int address, int value)
    cpdef int extra_read(self, int address) except -1
    cpdef extra_write(self, int address, int value)
    cpdef fault(self, int kind, int pc, long long tick)
    cpdef receiver_on(self, long long tick)
    cpdef byte_received(self, int value, int stop, long long tick)
    cpdef int outputs_changed(self, long long tick) except -1
    cpdef byte_sent(self, int value, long long tick)
