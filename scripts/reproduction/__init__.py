"""Tables 2 to 11 of Kósa and Mikula 2023 beside this program's figures: scripts/reproduce."""
