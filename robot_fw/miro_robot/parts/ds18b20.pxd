cimport cython
from miro_robot.parts.part cimport Part

cdef long long _NEVER
cdef int LOW, RELEASED
cdef int _IDLE, _PRESENCE, _ROM, _MATCH, _FUNCTION, _WRITE, _SEARCH, _READ_ROM, _SEND, _STATUS, _POWER
cdef int _ALARM_SEARCH, _CONVERT, _READ_SCRATCHPAD, _COPY, _RECALL
cdef int _NOT_CONVERTED, _FAMILY, _MISSING, _CRC, _SHORT

cdef class Ds18b20Part(Part):
    cdef public unsigned char rom[8]
    cdef readonly int is_parasite
    cdef readonly long long reset_ticks, wait_ticks, presence_ticks, slot_ticks, copy_ticks
    cdef readonly long long convert_ticks[4]
    cdef public int phase, done, byte, raw, sample, has_sample, has_alarm, broken
    cdef public long long fall_tick, ready_tick, copied_tick, conversions
    cdef public double temperature_c
    cdef public unsigned char user[3]
    cdef public unsigned char kept[3]
    cdef public unsigned char sent[9]

    cdef _lose(self)
    cdef _recall(self)
    cdef _reset(self, long long tick)
    cdef _go_to(self, int phase)
    cdef int _sends(self) noexcept
    cdef int _rom_bit(self, int number) noexcept
    cdef int _bit(self, long long tick) noexcept
    cdef _sent_one(self)
    @cython.locals(number=int)
    cdef _take(self, int level, long long tick)
    @cython.locals(command=int, index=int)
    cdef _command(self, long long tick)
    @cython.locals(bits=int, sixteenths=int)
    cdef _convert(self, long long tick)
    @cython.locals(degrees=int, high=int, low=int)
    cdef _finish(self, long long tick)
    cdef _load(self)
