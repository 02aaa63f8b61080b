"""Parts of scripts/check_study.py."""
