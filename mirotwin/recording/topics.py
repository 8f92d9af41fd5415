"""The topics of a recording: their names, and what they name.

/period                  a control period of the whole world
/net0/wire               the characters on the air of network 0
/net0/actions            what was done to its robots and its radio
/net0/camera/image       the frames of its camera
/net0/robot2/lm629       a channel of the robot in slot 2 of network 0
"""

import re
from typing import NamedTuple

PERIOD = "/period"
WIRE = "wire"
ACTIONS = "actions"
IMAGE = "camera/image"
_TOPIC = re.compile(rf"/net([0-9]{{1,9}})(?:/robot([0-9]{{1,9}}))?/([a-z0-9_]+|{IMAGE})")


class Topic(NamedTuple):
    """What a topic names. `network`, `slot`: -1 where it is of the world, or of a whole network."""

    channel: str
    network: int = -1
    slot: int = -1


def robot_topic(network: int, slot: int, channel: str) -> str:
    return f"/net{network}/robot{slot}/{channel}"


def wire_topic(network: int) -> str:
    return f"/net{network}/{WIRE}"


def actions_topic(network: int) -> str:
    return f"/net{network}/{ACTIONS}"


def image_topic(network: int) -> str:
    return f"/net{network}/{IMAGE}"


def topic_of(topic: str) -> Topic | None:
    """What `topic` names; None if it has not the form of one of ours."""
    if topic == PERIOD:
        return Topic(PERIOD)
    found = _TOPIC.fullmatch(topic)
    if found is None:
        return None
    network, slot, channel = found.groups()
    return Topic(channel, int(network), -1 if slot is None else int(slot))
