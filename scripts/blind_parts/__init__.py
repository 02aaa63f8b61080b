"""Pieces of the blind benchmark."""
