"""What `aeros verify` found, in the formats that people, programs and CI services read."""
