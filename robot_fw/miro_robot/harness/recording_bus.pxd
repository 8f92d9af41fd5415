from miro_robot.harness.harness cimport LiveOracle
from miro_robot.mcs51.cpu cimport Cpu
from miro_robot.mcs51.xram cimport XramBus

cdef int _KEPT, _NO_FAULT
cdef long long NEVER_TICK, STOPPED_TICK, _LONGEST

cdef class RecordingBus(XramBus):
    cdef public Cpu cpu
    cdef readonly list received, sent, resets
    cdef public int fault_kind
    cdef readonly int fault_pc
    cdef readonly long long fault_tick

    cpdef begin(self)

cdef class BareOracle(LiveOracle):
    cdef readonly object bus
    cdef readonly Cpu cpu
    cdef long long slept_tick

