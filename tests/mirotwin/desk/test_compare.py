"""The comparison of answers, beside the slow one of `tests.naive.port_answers`."""

from hypothesis import given
from hypothesis import strategies as st

from miro_protocol.frames import TeamFrame, TelemetryFrame, encode
from miro_protocol.transmission import DOWN, UP, Transmission, character_ticks
from miro_sim.periods import Period
from mirotwin.desk.compare import ANSWERS, compare
from tests.naive import port_answers

MS = 24_000
ANSWER_TICKS = 19 * character_ticks(UP)
question = st.fixed_dictionaries(
    {
        "gap_ms": st.sampled_from([34, 34, 34, 34, 34, 108, 111, 130, 150, 152, 300, 499, 510]),
        "words": st.tuples(st.integers(-4000, 4000), st.integers(-4000, 4000)),
        "late_us": st.sampled_from([0, 0, 40, 900, 5000, 15_000, 21_000, 30_000]),
        "lost": st.sampled_from(["", "", "", "", "port", "twin"]),
        "went": st.tuples(st.integers(-900, 900), st.integers(-900, 900)),
        "apart": st.tuples(st.integers(-400, 400), st.just(0)),
        "counted": st.sampled_from([0, 0, 0, 1]),
        "flags": st.sampled_from([0, 0, 8, 24]),
        "other_flags": st.sampled_from([0, 0, 0, 16]),
    }
)


def run(transmissions, end_tick=0):
    wire = tuple(sorted(transmissions, key=lambda one: one.tick))
    return [Period(0, 0, (), wire, ""), Period(1, end_tick, (), (), "")]


@given(
    st.lists(question, min_size=4, max_size=12),
    st.integers(0, 60_000),
    st.integers(0, 65535),
    st.integers(0, 255),
    st.integers(0, 200),
)
def test_the_comparison_finds_what_the_slow_one_finds(questions, way_us, offset, count, after_ms):
    tick, sent, port, twin = 1_000_000, [], [], []
    mine = theirs = (0, 0)
    accepted = 0
    for number, one in enumerate(questions):
        tick += one["gap_ms"] * MS
        frame = TeamFrame(3, number * 3 % 64, (one["words"], (0, 0), (0, 0)))
        sent.append(Transmission(tick, DOWN, encode(frame, 3)))
        theirs = tuple(at + by for at, by in zip(theirs, one["went"], strict=True))
        mine = tuple(at + by + more for at, by, more in zip(mine, one["went"], one["apart"], strict=True))
        accepted += one["counted"]
        twins = TelemetryFrame(frame.seq, 0, one["flags"], 0, 0, *(at % 65536 for at in theirs), number % 256)
        said = TelemetryFrame(
            *(frame.seq, 0, one["flags"] ^ one["other_flags"], 0, 0),
            *((at + offset) % 65536 for at in mine),
            (number + accepted + count) % 256,
        )
        end = sent[-1].end_tick + 25 * MS
        if one["lost"] != "twin":
            twin.append((end, twins))
        if one["lost"] != "port":
            port.append((end + (way_us + one["late_us"]) * 24, said))
    heard = [
        [Transmission(at - ANSWER_TICKS, UP, encode(said, 3)) for at, said in side] for side in (port, twin)
    ]
    lost_tick = sent[-1].end_tick + after_ms * MS
    found = compare(run([*sent, *heard[0]], lost_tick), run([*sent, *heard[1]]), 3)
    frames = [(one.end_tick, asked["words"]) for one, asked in zip(sent, questions, strict=True)]
    wanted = port_answers.compared(port, twin, frames, lost_tick, ANSWERS.within_counts, ANSWERS.within_ticks)
    if port:
        assert (sorted((one.tick, one.channel) for one in found.differences), found.not_judged) == (
            sorted(wanted[0]),
            wanted[1],
        )
    else:
        assert (found.differences, found.silent) == ([], (0,) if twin else ())
