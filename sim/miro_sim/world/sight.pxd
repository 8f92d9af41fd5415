# C layout of miro_sim.world.sight.
cimport cython
from miro_exact.rng cimport Stream
from miro_host.vision cimport Vision
from miro_sim.plant.drive cimport DifferentialDrive


cdef class GaussianSight:
    cdef readonly object bodies
    cdef readonly list visions, streams
    cdef public long long frame

    @cython.locals(place=Py_ssize_t, vision=Vision, noise=Stream, drive=DifferentialDrive, found=list)
    cpdef list expose(self, long long tick)
