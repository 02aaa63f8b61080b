"""The parts of design_study.py: ties.py, precision.py, limits.py; robots.py, what they share."""
