"""Output to terminals: harmless text, wrapped lines, tables, colours and progress."""
