"""Parts of scripts/servo_study.py."""
