"""Commands about AEROS itself: theorems, experiments, migrations of file formats."""
