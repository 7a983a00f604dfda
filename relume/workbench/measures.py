"""Measures of a picture's error against a reference: relMSE, efficiency, HDR-FLIP."""

from __future__ import annotations

import numpy as np

from relume.workbench.estimates import Estimate


def weight(R: np.ndarray) -> np.ndarray:
    """1 / (R² + 0.01 m²) for each pixel and channel, m being the mean of the picture R.

    The second term keeps pixels that are black in the reference from counting without bound. It is
    relative to the mean, so that an error does not depend on the unit of radiance. 0 if R is black.
    """
    denominator = R**2 + 0.01 * R.mean() ** 2
    return np.divide(1, denominator, out=np.zeros_like(R), where=denominator > 0)


def rel_mse(a: Estimate, reference: Estimate) -> tuple[float, float]:
    """Relative mean squared error mean((I - R)² / (R² + 0.01 m²)), and its debiased form.

    Args:
        a: `Estimate` of I.
        reference: `Estimate` of R, with mean m.

    Returns:
        The error as it is, and debiased: less the reference's own variance, which leaves bias² +
        variance of I. It may fall below 0 by chance.
    """
    w = weight(reference.pixels.mean)
    square = (a.pixels.mean - reference.pixels.mean) ** 2
    return float((square * w).mean()), float(((square - reference.pixels.variance) * w).mean())


def noise(a: Estimate, R: np.ndarray) -> float:
    """Relative mean squared error of the noise of an estimate alone, as `rel_mse` weighs it.

    Args:
        a: `Estimate`.
        R: picture for the weights. If it is that of `a` itself, bright outliers of `a` count less:
            to compare two methods, take the mean of both.
    """
    return float((a.pixels.variance * weight(R)).mean())


def efficiency(mse: float, seconds: float) -> float | None:
    """1 / (MSE · t) [1/s]: the same for any number of samples; None for no noise or no time."""
    return 1 / (mse * seconds) if mse > 0 and seconds > 0 else None


def flip(picture: np.ndarray, reference: np.ndarray) -> tuple[np.ndarray, float] | None:
    """HDR-FLIP: how visible a difference is when the eye flips between two pictures.

    Args:
        picture: shape (height, width, 3), linear.
        reference: same shape.

    Returns:
        The map, (height, width) from 0 to 1, and its mean; None if the reference is black or
        the package flip-evaluator is not installed.

    Source: Andersson et al., Visualizing errors in rendered high dynamic range images,
    Eurographics 2021, with its own settings: 67 pixels per degree, exposures from the reference.
    """
    try:
        import flip_evaluator
    except ImportError:
        return None
    brightest = reference.max()
    if not brightest > 0:
        return None
    # Its exposures follow the brightness, but it ends the process where all is darker than 1e-7.
    scaled = (np.maximum(x / brightest, 0).astype(np.float32) for x in (reference, picture))
    errors, mean, _ = flip_evaluator.evaluate(*scaled, "HDR", applyMagma=False, parameters={})
    return errors[..., 0], float(mean)
