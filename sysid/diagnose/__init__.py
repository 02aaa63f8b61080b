"""Where a model fails, which effect is missing, and what its logs cannot tell."""
