"""CRC-16 5935h reflected, one bit at a time, and PN9 by its recurrence over a plain list: nothing clever."""


def crc16(data):
    register = 0xFFFF
    for byte in data:
        for bit in range(8):
            wrong = (register ^ byte >> bit) & 1
            register >>= 1
            if wrong:
                register ^= 0xAC9A
    return register ^ 0xFFFF


def pn9(length):
    bits = [1] * 9
    while len(bits) < 8 * length:
        bits.append(bits[-9] ^ bits[-4])
    return bytes(sum(bits[8 * i + k] << k for k in range(8)) for i in range(length))
