"""Boxes and how conditions narrow them: what is believed where bounds alone say that nothing can hold."""
