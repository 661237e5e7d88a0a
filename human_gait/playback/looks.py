"""Colours and sizes that the page and the film have in common."""

COLOURS = {  # of what is drawn beside the body; the feet: two of Okabe and Ito's
    "right": 0xD55E00,
    "left": 0x0072B2,
    "zmp": 0xE3008C,
    "support": 0xF0C000,
}

FOOTHOLDS = {"right": 0xEBAF80, "left": 0x7DB4D4}
"""Colours of where the feet stand."""

ARROW_LENGTH = 0.45
"""Length of the arrow of a force of one body weight, of the stature."""
