"""Parts that a board may have beside its processor: electronics, one file a part."""

ELECTRONICS = {
    "button": "miro_robot.parts.button:Button",
    "buzzer": "miro_robot.parts.buzzer:Buzzer",
    "led": "miro_robot.parts.led:Led",
}
"""Name to the struct of its keys. Parts that move are the physical world's."""
