"""What all commands share: options, exit codes, the screen, files that are whole or not there."""
