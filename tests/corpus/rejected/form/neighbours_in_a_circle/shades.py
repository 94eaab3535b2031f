from aeros.perception import View

from .bounds import LEAST

DARK = LEAST + 60


def is_clean(view: View) -> bool:
    return bool((view.pictures["overhead"].rgb > DARK).all())
