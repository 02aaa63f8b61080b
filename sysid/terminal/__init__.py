"""What the commands print for a person: tables, notices, progress. Computes nothing."""
