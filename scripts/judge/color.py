"""The sRGB curve (IEC 61966-2-1), luminance, and the L* of CIE 1976 with its u8 code."""

import numpy as np

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def linear(samples, transfer):
    """Linear values of u8 samples."""
    value = np.arange(256) / 255.0
    if transfer == "srgb":
        value = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    elif transfer != "linear":
        raise ValueError(f"transfer {transfer}")
    return value[samples]


def display(value):
    """8-bit display values of linear ones."""
    value = np.clip(value, 0.0, 1.0)
    curve = np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return np.floor(255.0 * curve + 0.5).astype(np.uint8)


def luminance(samples, transfer):
    """Y of u8 samples [..., channel]; a single channel is its own."""
    values = linear(samples, transfer)
    return values @ LUMINANCE if samples.shape[-1] == 3 else values[..., 0]


def scaled_lightness(y, white):
    """2.55 L*, clipped at L* = 100, before rounding to the code."""
    y = np.minimum(y / white, 1.0)
    curve = np.where(y > (6 / 29) ** 3, np.cbrt(y), y / (3 * (6 / 29) ** 2) + 4 / 29)
    return 2.55 * (116.0 * curve - 16.0)
