cimport cython
from miro_robot.empty_board cimport EmptyBoard
from miro_robot.parts.nets cimport Nets

cdef long long CYCLE_TICKS, NEVER_TICK, _BEHIND_TICKS
cdef int FAULT, REPLAN, _CONTENTION, _FAULTS_KEPT


cdef class WiredBoard(EmptyBoard):
    cdef readonly list parts
    cdef readonly dict part_index
    cdef readonly Nets nets
    cdef long long horizon

    cdef int _run(self, tuple addresses, long long until_tick) except -1
    cdef int _run_on(self, tuple marks, long long until_cycle) except -1
    @cython.locals(due='long long', stop_cycle='long long')
    cdef int _run_pieces(self, long long until_cycle) except -1
    @cython.locals(now='long long')
    cpdef int sync(self, long long tick) except -1
    @cython.locals(port=int, net=int, due='long long')
    cdef int _push(self, long long tick) except -1
    cdef _note_faults(self, long long tick)
    cdef _note(self, int kind, str detail, long long tick)
    cdef _supply(self, int on, long long tick)
