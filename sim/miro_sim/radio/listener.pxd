cimport cython

from miro_robot.mcs51.line cimport Line
from miro_sim.radio.chain cimport Chain
from miro_sim.radio.sender cimport Sender
from miro_sim.radio.slicer cimport Slicer
from miro_exact.rng cimport Stream

cdef long long _BIT, _CHARACTER
cdef unsigned long long _ONE
cdef int _DOWN, _NOISE, _INVERTED, _AT_1


@cython.final
cdef class Listener:
    cdef readonly Line line
    cdef public int link_state, rxd_state
    cdef readonly long long bit_errors
    cdef readonly Slicer slicer
    cdef Stream errors, noise, idle, lost, collision
    cdef Chain bursts, dropouts
    cdef unsigned long long threshold, burst_threshold, false_start, lost_threshold
    cdef bint squelch, noise_alone

    @cython.locals(line=Line, heard=Line)
    cpdef fill_broken(self, long long tick, long long until, list senders, Py_ssize_t rank)
    @cython.locals(sender=Sender, start='long long', stop='long long', level=int)
    cpdef fill(self, long long tick, long long until, list senders, Py_ssize_t rank)
    @cython.locals(sender=Sender)
    cdef long long pause(self, long long tick, long long until, list senders, Py_ssize_t rank) except *
    @cython.locals(bits='unsigned long long', level=int, before=int)
    cdef void hear_noise(self, long long tick, long long until) except *
    cdef int silence(self, long long tick, long long slot) except -1
    cdef void hear_idle(self, long long tick, long long until, list senders, Py_ssize_t rank) except *
    cdef int idle_level(self, long long tick, long long slot, list senders, Py_ssize_t rank) except -1
    @cython.locals(sender=Sender, first='long long', begun='long long', number='long long', count='long long',
                   begin='long long', step='long long', place=int, levels=int, level=int, before=int)
    cdef void hear_data(self, long long tick, long long until, long long start, bytes data, bytes stops, list senders,
                        Py_ssize_t rank) except *
    cdef long long next_judged(
        self, long long first, long long number, long long count, bytes stops, list senders, Py_ssize_t rank
    ) except *
    cdef void hear_bad_stop(self, long long tick, long long until, long long begin, long long back) except *
    cdef int bit(
        self, long long begin, int sent, long long first, long long number, bint fresh, list senders, Py_ssize_t rank
    ) except -1
    @cython.locals(sender=Sender)
    cdef int mixed(self, int level, long long begin, list senders, Py_ssize_t rank) except -1
