"""Being written."""


def add_to(c):
    pass
