"""Tables 2 to 8 of Kósa and Mikula 2023 beside this program's figures: scripts/reproduce."""
