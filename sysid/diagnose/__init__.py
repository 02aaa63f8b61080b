"""Where a model fails, which effect is missing, what a log cannot show, and which explanations it
cannot tell apart."""
