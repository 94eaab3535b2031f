"""The plant `franka`: a Franka Research 3 through the maker's library `pylibfranka`."""
