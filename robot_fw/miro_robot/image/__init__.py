"""A firmware image with its debug files: Intel HEX, symbols, C lines."""

from miro_robot.image.hex import FLASH_BYTES, SPACE_BYTES, Image, ImageError, load_hex, parse_hex
from miro_robot.image.symbol_files import Symbol, Symbols

__all__ = ["FLASH_BYTES", "SPACE_BYTES", "Image", "ImageError", "Symbol", "Symbols", "load_hex", "parse_hex"]
