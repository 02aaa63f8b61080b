"""Parts of scripts/fuzz_readers.py."""
