"""What a wheel is told by commands of chance, beside the slow twin."""

from hypothesis import given
from hypothesis import strategies as st

from miro_robot.lm629.orders import WheelOrder
from tests.naive.robot_rules import Wheel

STT, RESET, LTRJ, RDRP = 0x01, 0x00, 0x1F, 0x0A
CONTROLS = st.integers(0, 0x1FFF)
LOADS = st.builds(lambda word, data: word.to_bytes(2, "big") + data, CONTROLS, st.binary(max_size=12))
COMMANDS = st.one_of(
    st.tuples(st.just(LTRJ), LOADS), st.tuples(st.sampled_from([STT, RESET, RDRP]), st.just(b""))
)


@given(st.lists(COMMANDS, max_size=30))
def test_orders_are_those_of_the_slow_twin(commands):
    order, twin = WheelOrder(), Wheel()
    for opcode, data in commands:
        given_one = order.take(opcode, data)
        assert given_one == (opcode in (STT, RESET))
        if opcode == LTRJ:
            twin.load(data)
        elif opcode == RESET:
            twin.reset()
        elif opcode == STT:
            twin.start()
        assert (order.what, order.velocity, order.acceleration, order.abrupt) == twin.order
        assert order.moves() == (twin.order[0] == "drive" and twin.order[1] != 0)
        word = 0 if twin.order[0] != "drive" else twin.order[1] / 256
        assert order.word() == (word if word == int(word) else 1 << 30)
