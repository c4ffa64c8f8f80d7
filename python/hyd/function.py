"""A model as a function of some of its parameters, with exact derivatives, and the ways into optimisers."""

from __future__ import annotations

from typing import Any, Callable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import ArrayLike

from . import _hyd
from .errors import ModelError, UsageError
from .values import counted


class Problem(NamedTuple):
    """Residuals and their Jacobian: ``scipy.optimize.least_squares(problem.fun, x0, jac=problem.jac)``."""

    fun: Callable[[np.ndarray], np.ndarray]
    jac: Callable[[np.ndarray], np.ndarray]


class Function:
    """Values of outputs at times, as a function of parameters; made by :meth:`hyd.Model.function`.

    Values are a flat array, time by time, the outputs of one time side by side; :meth:`unflatten` gives rows and columns. Derivatives are forward
    sensitivities of the solver, not differences. A call runs the model once; threads call beside each other.

    Attributes
    ----------
    outputs, parameters : list of str
        Names of results and arguments.
    at : numpy.ndarray
        Times of the results in s.
    start : numpy.ndarray
        Values that the arguments have in the model.
    """

    def __init__(self, function: _hyd.Function, outputs: Sequence[str], parameters: Sequence[str], made: tuple):
        self._function = function
        self.outputs: List[str] = list(outputs)
        self.parameters: List[str] = list(parameters)
        self.at: np.ndarray = np.asarray(function.at)
        self.start: np.ndarray = np.asarray(function.start())
        self._made = made

    @property
    def size(self) -> int:
        """Number of values."""
        return len(self.at) * len(self.outputs)

    def unflatten(self, values: np.ndarray) -> np.ndarray:
        """Values with a row for each time and a column for each output."""
        return np.asarray(values).reshape(len(self.at), len(self.outputs))

    def __call__(self, p: ArrayLike) -> np.ndarray:
        """Values at these arguments."""
        return self._whole(np.asarray(self._function.values(self._arguments(p)))).ravel()

    def jacobian(self, p: ArrayLike) -> np.ndarray:
        """Derivatives at these arguments: a row for each value, a column for each argument."""
        return self.value_and_jacobian(p)[1]

    def value_and_jacobian(self, p: ArrayLike) -> Tuple[np.ndarray, np.ndarray]:
        """Both, from one run."""
        arguments = self._arguments(p)
        found, derivatives = self._function.values_and_derivatives(arguments)
        values = self._whole(np.asarray(found)).ravel()
        return values, np.asarray(derivatives).reshape(self.size, len(self.parameters))

    def for_scipy(self, measured: Any, sigma: Any = 1.0) -> Problem:
        """Residuals ``(f(p) - measured) / sigma`` and their Jacobian, from one run where both are asked for at the same arguments.

        Examples
        --------
        >>> from scipy.optimize import least_squares
        >>> lift = model.function(["y"], ["p0"], at=[0.005, 0.01])
        >>> problem = lift.for_scipy(lift([12e6]), sigma=1e-6)
        >>> fit = least_squares(problem.fun, [10e6], jac=problem.jac, x_scale=1e6)
        >>> bool(abs(fit.x[0] - 12e6) < 1e3)
        True
        """
        target = np.asarray(measured, dtype=float).ravel()
        deviations = np.asarray(sigma, dtype=float).ravel()
        for word, count in (("measured", target.size), ("sigma", deviations.size)):
            if count != self.size and not (word == "sigma" and np.ndim(sigma) == 0):
                raise UsageError(f"{word}: {counted(count, 'value')}, and {counted(len(self.at), 'time')} of {counted(len(self.outputs), 'output')} are {self.size}")
        if not (deviations > 0).all() or not np.isfinite(deviations).all():
            raise UsageError("sigma: standard deviations are numbers greater than 0")
        weights = np.broadcast_to(1.0 / deviations, (self.size,))
        # One object, so that threads see arguments with their own values.
        last: List[Tuple[bytes, np.ndarray, np.ndarray]] = []

        def both(p: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
            key = np.asarray(p, dtype=float).tobytes()
            for known, values, jacobian in last[:1]:
                if known == key:
                    return values, jacobian
            values, jacobian = self.value_and_jacobian(p)
            last[:] = [(key, values, jacobian)]
            return values, jacobian

        return Problem(
            lambda p: weights * (both(p)[0] - target),
            lambda p: weights[:, None] * both(p)[1],
        )

    def to_jax(self) -> Callable:
        """The function for JAX, with its derivative (``jax.custom_jvp``); numbers are 64 bit if JAX is configured so (``jax_enable_x64``)."""
        import jax
        import jax.numpy as jnp

        def host(p):
            return self(np.asarray(p, dtype=float))

        def host_both(p):
            return self.value_and_jacobian(np.asarray(p, dtype=float))

        def shapes(p):
            kind = jnp.result_type(p, float)
            return jax.ShapeDtypeStruct((self.size,), kind), jax.ShapeDtypeStruct((self.size, len(self.parameters)), kind)

        @jax.custom_jvp
        def function(p):
            value, _ = shapes(p)
            return jax.pure_callback(lambda own: host(own).astype(value.dtype), value, p, vmap_method="sequential")

        @function.defjvp
        def _(primals, tangents):
            (p,), (direction,) = primals, tangents
            value, jacobian = shapes(p)

            def numbers(own):
                values, derivatives = host_both(own)
                return values.astype(value.dtype), derivatives.astype(jacobian.dtype)

            values, derivatives = jax.pure_callback(numbers, (value, jacobian), p, vmap_method="sequential")
            return values, derivatives @ direction

        return function

    def to_torch(self) -> Callable:
        """The function for PyTorch, with its first derivative (``torch.autograd.Function``); second ones are refused."""
        import torch
        from torch.autograd.function import once_differentiable

        own = self

        class Evaluated(torch.autograd.Function):
            @staticmethod
            def forward(context, p):
                arguments = p.detach().cpu().double().numpy()
                if context.needs_input_grad[0]:
                    values, jacobian = own.value_and_jacobian(arguments)
                    context.save_for_backward(torch.tensor(jacobian, dtype=p.dtype, device=p.device))
                else:
                    values = own(arguments)
                return torch.tensor(values, dtype=p.dtype, device=p.device)

            @staticmethod
            @once_differentiable
            def backward(context, *gradients):
                (jacobian,) = context.saved_tensors
                return gradients[0] @ jacobian

        return Evaluated.apply

    def _arguments(self, p: ArrayLike) -> list:
        arguments = np.atleast_1d(np.asarray(p, dtype=float)).ravel()
        if arguments.shape != (len(self.parameters),):
            raise UsageError(f"{counted(arguments.size, 'value')} for {counted(len(self.parameters), 'parameter')}")
        return arguments.tolist()

    def _whole(self, values: np.ndarray) -> np.ndarray:
        """Refuses values of a run that the model ended before the last time."""
        missing = np.isnan(values).all(axis=1)
        if missing.any():
            first = float(self.at[int(np.argmax(missing))])
            raise ModelError(f"the model ended the run before {first} s")
        return values

    def __reduce__(self):
        return (made, self._made)

    def __repr__(self) -> str:
        return f"<hyd.Function of {', '.join(self.parameters)}: {', '.join(self.outputs)} at {counted(len(self.at), 'time')}>"


def made(model: Any, given: list, wanted: dict) -> Function:
    """A function of a model of the package; ``wanted`` as the extension takes it."""
    own = model._model.function(given, wanted)
    return Function(own, wanted["outputs"], wanted["parameters"], (model, given, wanted))
