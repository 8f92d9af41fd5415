cimport cython
from miro_host.integrator cimport Integrator
from miro_host.wheels cimport wheel_command


cdef class Pilot:
    cdef readonly object reference, law, estimator, wheels
    cdef readonly Integrator integrator
    cdef object _asked
    cdef double _asked_s
    cdef readonly object command
    cdef public list numbers
    cdef readonly double reference_lead_s, dead_s, units_per_m_s

    @cython.locals(at_s=double)
    cpdef update(self, measured, double t_s, telemetry=*)
    cpdef reference_at(self, double t_s)
    cdef _answered(self, str word, plugin, given)


cpdef check_answer(answer, tuple inner)
cpdef check_estimate(estimate, tuple inner)
cdef dict _in_order(values, tuple declared)
@cython.locals(known=cython.bint)
cdef int _check_inner(values, tuple declared) except -1
@cython.locals(real=double)
cdef int _check(name, value) except -1
