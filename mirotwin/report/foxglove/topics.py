"""The topics that are derived: their names begin with /foxglove, so that they stand apart from what was recorded.

/foxglove/transforms            foxglove.FrameTransforms, each control period
/foxglove/scene                 foxglove.SceneUpdate: pitch, ball, robots, references; each second
/foxglove/trails                foxglove.SceneUpdate: where robots were; each control period
/foxglove/log                   foxglove.Log
/foxglove/net0/image            foxglove.CompressedImage: each recorded frame of the camera of network 0
/foxglove/net0/calibration      foxglove.CameraCalibration, each second
/foxglove/net0/robot0/error     ours, for plots: truth against reference, each control period
"""

PREFIX = "/foxglove/"
TRANSFORMS = PREFIX + "transforms"
SCENE = PREFIX + "scene"
TRAILS = PREFIX + "trails"
LOG = PREFIX + "log"


def image_topic(network: int) -> str:
    return f"{PREFIX}net{network}/image"


def calibration_topic(network: int) -> str:
    return f"{PREFIX}net{network}/calibration"


def error_topic(network: int, slot: int) -> str:
    return f"{PREFIX}net{network}/robot{slot}/error"
