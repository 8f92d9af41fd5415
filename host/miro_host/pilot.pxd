# C layout of miro_host.pilot.
cimport cython


cdef class Pilot:
    cdef readonly object reference, law, estimator, wheels, integrator
    cdef public object command
    cdef readonly double reference_lead_s, dead_s, units_per_m_s

    cpdef update(self, measured, double t_s, telemetry=*)
    cdef _estimate(self, given)
    cdef _ask(self, given)


cpdef check_answer(answer, tuple inner)
cpdef check_estimate(estimate, tuple inner)
@cython.locals(values=dict, name=str)
cdef int _check_inner(values, tuple declared) except -1
@cython.locals(real=double)
cdef int _check(name, value) except -1
