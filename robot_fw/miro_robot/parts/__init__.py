"""Parts that a board may have beside its processor: electronics, one file a part."""

ELECTRONICS = {
    "at24c": "miro_robot.parts.at24c:At24c",
    "bluetooth": "miro_robot.parts.bluetooth:Bluetooth",
    "button": "miro_robot.parts.button:Button",
    "buzzer": "miro_robot.parts.buzzer:Buzzer",
    "dht11": "miro_robot.parts.dht11:Dht11",
    "dht22": "miro_robot.parts.dht11:Dht22",
    "ds18b20": "miro_robot.parts.ds18b20:Ds18b20",
    "hc595": "miro_robot.parts.hc595:Hc595",
    "hc_sr04": "miro_robot.parts.hc_sr04:HcSr04",
    "l293d": "miro_robot.parts.l298:L293d",
    "l298": "miro_robot.parts.l298:L298",
    "lcd1602": "miro_robot.parts.lcd1602:Lcd1602",
    "lcd2004": "miro_robot.parts.lcd1602:Lcd2004",
    "led": "miro_robot.parts.led:Led",
    "lm629": "miro_robot.parts.lm629:Lm629Keys",
    "pcf8591": "miro_robot.parts.pcf8591:Pcf8591",
    "relay": "miro_robot.parts.relay:Relay",
    "rs485": "miro_robot.parts.rs485:Rs485",
    "servo": "miro_robot.parts.servo:Servo",
    "seven_segment": "miro_robot.parts.seven_segment:SevenSegment",
}
"""Name to the struct of its keys. Parts that move are the physical world's."""
