"""How sound fades in the sea, and how often a modem then takes a bit for the other: formulae, each with its source."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Water:
    """What of sea water absorption hangs on: temperature in degrees Celsius, salinity in parts per thousand, depth in
    metres, pH. The defaults are those of a temperate shelf sea."""

    temperature_c: float = 10.0
    salinity_ppt: float = 35.0
    depth_m: float = 20.0
    ph: float = 8.0


SHELF_SEA = Water()


def absorption_db_per_km(frequency_hz: float, water: Water = SHELF_SEA) -> float:
    """The share of sound that sea water absorbs, in dB a kilometre; good from 200 Hz to 1 MHz.

    Francois and Garrison, "Sound absorption based on ocean measurements. Part II: Boric acid contribution and equation
    for total absorption", J. Acoust. Soc. Am. 72 (1982), 1879-1890: the sum of what boric acid, magnesium sulphate and
    the water itself absorb.
    """
    t_c, s_ppt, depth_m = water.temperature_c, water.salinity_ppt, water.depth_m
    f_khz = frequency_hz / 1000.0
    speed_mps = 1412.0 + 3.21 * t_c + 1.19 * s_ppt + 0.0167 * depth_m

    boric_khz: float = 2.8 * math.sqrt(s_ppt / 35.0) * 10.0 ** (4.0 - 1245.0 / (273.0 + t_c))
    boric: float = 8.86 / speed_mps * 10.0 ** (0.78 * water.ph - 5.0) * boric_khz / (boric_khz**2 + f_khz**2)

    sulphate_khz: float = 8.17 * 10.0 ** (8.0 - 1990.0 / (273.0 + t_c)) / (1.0 + 0.0018 * (s_ppt - 35.0))
    sulphate: float = 21.44 * s_ppt / speed_mps * (1.0 + 0.025 * t_c) * sulphate_khz / (sulphate_khz**2 + f_khz**2)
    sulphate *= 1.0 - 1.37e-4 * depth_m + 6.2e-9 * depth_m**2

    if t_c <= 20.0:
        pure = 4.937e-4 - 2.59e-5 * t_c + 9.11e-7 * t_c**2 - 1.50e-8 * t_c**3
    else:
        pure = 3.964e-4 - 1.146e-5 * t_c + 1.45e-7 * t_c**2 - 6.5e-10 * t_c**3
    pure *= 1.0 - 3.83e-5 * depth_m + 4.9e-10 * depth_m**2

    return (boric + sulphate + pure) * f_khz**2


def transmission_loss_db(range_m: float, spreading: float, absorption_db_per_km: float) -> float:
    """By how much sound is fainter at a distance than at 1 m, in dB: `spreading` times the range's logarithm, and what
    is absorbed (Urick, Principles of Underwater Sound, 3rd ed., section 5.2).

    `spreading`: 20 in the open, 10 between surface and bottom, 15 as a compromise between both. Within 1 m none.
    """
    return spreading * math.log10(max(range_m, 1.0)) + absorption_db_per_km * range_m / 1000.0


def bit_energy_db(level_db: float, noise_db: float, rate_bps: float) -> float:
    """Eb/N0 in dB of a signal that arrives with a level in dB re 1 uPa over noise with a spectral density in dB re
    1 uPa^2/Hz: a bit's energy is the signal's power over the time that one takes.

    The ratio of powers in a band of B Hz, times B over the rate, is the same: how wide the band is falls out.
    """
    return level_db - noise_db - 10.0 * math.log10(rate_bps)


def coherent_bpsk_error_rate(bit_energy: float) -> float:
    """Share of bits that coherent binary phase-shift keying gets wrong in white noise, Eb/N0 as a ratio:
    0.5 erfc(sqrt(Eb/N0)) (Proakis, Digital Communications, 4th ed., section 5.2.1)."""
    return 0.5 * math.erfc(math.sqrt(bit_energy))


def noncoherent_fsk_error_rate(bit_energy: float, rician_k: float = math.inf) -> float:
    """Share of bits that noncoherent binary frequency-shift keying gets wrong in white noise, Eb/N0 as a ratio.

    Without fading 0.5 exp(-Eb/N0 / 2) (Proakis, section 5.4.1). `rician_k`: where the signal fades, the power of the
    steady path over that of all others, and Eb/N0 is the mean: (1 + K) / (2 + 2 K + Eb/N0) exp(-K Eb/N0 / (2 + 2 K +
    Eb/N0)) (Simon and Alouini, Digital Communication over Fading Channels, section 8.2.3); 0 is Rayleigh's fading,
    1 / (2 + Eb/N0), infinity none.
    """
    if math.isinf(rician_k):
        return 0.5 * math.exp(-bit_energy / 2.0)
    whole = 2.0 + 2.0 * rician_k + bit_energy
    return (1.0 + rician_k) / whole * math.exp(-rician_k * bit_energy / whole)


def frame_error_rate(bit_error_rate: float, bits: int) -> float:
    """Share of frames of so many bits with at least one wrong, where bits go wrong each by itself."""
    if bit_error_rate >= 1.0:
        return 1.0
    return -math.expm1(bits * math.log1p(-bit_error_rate))
