"""Parts of scripts/formula_study.py."""
