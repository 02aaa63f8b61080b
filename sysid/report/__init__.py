"""Pictures of results. Computes nothing."""
