# C layout of miro_sim.plant.circuit.
cimport cython
from miro_exact cimport dmath

cdef int MAX_TICKS
cdef double TICK_S

@cython.final
cdef class Winding:
    cdef public double current_a
    cdef readonly int drive, wanted, wait_ticks, on_ticks, off_ticks
    cdef readonly double drive_v, diode_v, drive_ohm, diode_ohm, drive_tau, diode_tau, up_v, down_v
    cdef double drive_decay[2049]
    cdef double diode_decay[2049]

    @cython.locals(longest=int)
    cpdef int after_load(self) except -1
    @cython.locals(wanted=int)
    cpdef void set_bridge(self, int enable, int forward) noexcept
    cdef void _switch(self, int drive) noexcept
    @cython.locals(wait=int, charge=double)
    cpdef double step(self, int ticks, double emf_v) except? -7.5
    @cython.locals(start=double, positive=cython.bint, voltage=double, ohm=double, tau=double, decay=double,
                   final=double, end=double, crossing=double)
    cdef inline double _flow(self, int ticks, double emf_v) except? -7.5
    @cython.locals(voltage=double, driven=cython.bint, ohm=double, tau=double, final=double)
    cdef double _onward(self, double ticks, double emf_v) except? -7.5
