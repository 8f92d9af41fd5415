"""Parts that a board may have beside its processor: electronics, one file a part."""

ELECTRONICS = {
    "led": "miro_robot.parts.led:Led",
}
"""Name to the struct of its keys. Parts that move are the physical world's."""
