"""What can be wrong with a log: a module for each thing that tells it.

A module has `find(look)`, which yields faults; AFTER, the order in which it is asked; and
SENSELESS, the faults of which an error would make its answers so.
"""
