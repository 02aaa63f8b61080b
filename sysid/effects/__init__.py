"""The vocabulary: one physical effect a file, named as in experiment files and on the command line."""
