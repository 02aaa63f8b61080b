"""Parts of scripts/fleet_study.py."""
