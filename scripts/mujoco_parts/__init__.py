"""Arms in MuJoCo with something hidden, and what a diagnosis says of their logs."""
