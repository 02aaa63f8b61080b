"""Parts of scripts/kill_study.py."""
