"""The LM629 motion controller: host port, profile generator, PID filter, PWM stage and encoder input."""
