"""What every parameterization of a body's inertia offers the solver."""

from abc import ABC, abstractmethod

import numpy as np


class Parameterization(ABC):
    """A map theta (..., 10) -> pi (..., 10) with its inverse and its first two derivatives."""

    name: str
    coordinates: tuple[str, ...]

    @abstractmethod
    def parameters(self, theta) -> np.ndarray:
        """Inertial parameters pi (..., 10) at theta (..., 10)."""

    @abstractmethod
    def inverse(self, pi) -> np.ndarray:
        """Coordinates theta (..., 10) of physically possible parameters pi (..., 10)."""

    @abstractmethod
    def jacobian(self, theta) -> np.ndarray:
        """Gamma = d pi / d theta (..., 10, 10); rows are inertial parameters."""

    @abstractmethod
    def hessian(self, theta, gradient) -> np.ndarray:
        """sum_k gradient_k d^2 pi_k / d theta^2 (..., 10, 10) for a gradient (..., 10)."""
