cimport cython
from miro_robot.parts.i2c cimport I2cTarget

cdef int _ADDRESS_PINS, _OUTPUT, _COUNTS, _AFTER_POWER_ON

cdef class Pcf8591Part(I2cTarget):
    cdef readonly double step_v
    cdef public int control, output, result, taken
    cdef public long long conversions
    cdef public double volts[4]

    @cython.locals(before=int, channel=int, plus=int, minus=int)
    cpdef int transmit(self, long long tick) except -1
    @cython.locals(steps=double)
    cdef int _code(self, int plus, int minus) except -1
