"""Where a model fails, which effect is missing, what its logs cannot tell: diagnose(experiment)."""

from ..callable_module import callable_module

callable_module(__name__, "diagnosis", "diagnose")
