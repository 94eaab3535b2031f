from .shades import DARK

LEAST = 20
MOST = 2 * DARK
