cimport cython
from miro_robot.event_log cimport EventLog
from miro_robot.mcs51.bus cimport Bus
from miro_robot.mcs51.cpu cimport Cpu

cdef long long CYCLE_TICKS
cdef int REACHED, RECEIVED, SENT, BREAKPOINT


cdef class ProcessorBoard(Bus):
    cdef readonly Cpu cpu
    cdef readonly EventLog log
    cdef public bint stop_on_fault
    cdef public object faults
    cdef readonly object symbols
    cdef readonly int stuck_low[4]
    cdef readonly int stuck_high[4]

    cpdef load(self, image)
    @cython.locals(mask=int)
    cdef _hold_pin(self, int port, int bit, int level, int outside)
    @cython.locals(port=int)
    cpdef after_load(self)
    cpdef int run(self, long long until_tick) except -1
    cpdef int run_to_any(self, tuple addresses, long long until_tick) except -1
    cpdef set_reset(self, int level)
    cpdef set_power(self, int on)
