"""Planners and the checks that every plan passes before it is used."""
