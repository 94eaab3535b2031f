from aeros.perception import View

DARK = 60


def is_clean(view: View) -> bool:
    return bool((view.pictures["overhead"].rgb > DARK).all())
