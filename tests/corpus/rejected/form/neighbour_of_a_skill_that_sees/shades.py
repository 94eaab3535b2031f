import numpy as np

from aeros.perception import View

DARK = 60


def is_clean(view: View) -> bool:
    return bool(np.all(view.pictures["overhead"].rgb > DARK))
