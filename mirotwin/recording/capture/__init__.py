"""Characters of a radio network from files of several formats, decoded.

What belongs here: telling formats apart (`detect`), reading them as transmissions (`hextext`, `recorded`, `source`),
finding out how many robots a network has (`layout`), and decoding transmissions to rows (`rows`) for people and
machines (`render`). What does not: the formats' own grammar where `miro_protocol` has it, and the commands (`cli`).

Everything is read once, in pieces: what is kept does not grow with the file. In formats without time (raw, hex) ticks
count on as if the whole input were one transmission.
"""
