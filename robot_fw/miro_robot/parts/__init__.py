"""Parts that a board may have beside its processor: electronics, one file a part."""

ELECTRONICS = {
    "button": "miro_robot.parts.button:Button",
    "buzzer": "miro_robot.parts.buzzer:Buzzer",
    "led": "miro_robot.parts.led:Led",
    "lm629": "miro_robot.parts.lm629:Lm629Keys",
}
"""Name to the struct of its keys. Parts that move are the physical world's."""
