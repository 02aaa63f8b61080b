"""The report's page, alive in the browser: look, add, refit, undo. The experiment file on disk stays the truth."""
