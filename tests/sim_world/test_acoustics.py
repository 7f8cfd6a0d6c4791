"""How sound fades and how often bits are wrong, beside published values and the formulae worked out by hand."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_world.acoustics import (
    Water,
    absorption_db_per_km,
    bit_energy_db,
    coherent_bpsk_error_rate,
    frame_error_rate,
    noncoherent_fsk_error_rate,
    transmission_loss_db,
)


def ainslie_mccolm_db_per_km(f_khz: float, t_c: float, s_ppt: float, depth_km: float, ph: float) -> float:
    """A simpler formula, fitted to the same measurements: Ainslie and McColm, J. Acoust. Soc. Am. 103 (1998), 1671."""
    boric_khz = 0.78 * math.sqrt(s_ppt / 35) * math.exp(t_c / 26)
    sulphate_khz = 42 * math.exp(t_c / 17)
    boric = 0.106 * boric_khz / (boric_khz**2 + f_khz**2) * math.exp((ph - 8) / 0.56)
    sulphate = 0.52 * (1 + t_c / 43) * s_ppt / 35 * sulphate_khz / (sulphate_khz**2 + f_khz**2)
    pure = 0.00049 * math.exp(-(t_c / 27 + depth_km / 17))
    return (boric + sulphate * math.exp(-depth_km / 6) + pure) * f_khz**2


class TestAbsorption:
    @pytest.mark.parametrize(
        ("frequency_hz", "water", "published_db_per_km"),
        [
            (50e3, Water(27, 35, 10, 8.1), 10.71),  # arlpy's documentation of its Francois-Garrison model
            (100e3, Water(14, 38.5, 0, 8.1), 40),  # the Mediterranean, as arlpy's tests have it, at three depths
            (100e3, Water(14, 38.5, 2000, 8.1), 30),
            (100e3, Water(14, 38.5, 6000, 8.1), 16),
            (10e3, Water(15, 35, 10, 8.1), 1),
        ],
    )
    def test_it_is_as_published(self, frequency_hz: float, water: Water, published_db_per_km: float) -> None:
        within = 0.005 if published_db_per_km == 10.71 else 0.5
        assert absorption_db_per_km(frequency_hz, water) == pytest.approx(published_db_per_km, abs=within)

    @pytest.mark.parametrize("frequency_khz", [1, 10, 11.52, 25, 50, 100])
    @pytest.mark.parametrize("temperature_c", [4, 10, 18])
    def test_the_other_formula_of_the_same_measurements_is_within_15_percent(
        self, frequency_khz: float, temperature_c: float
    ) -> None:
        ours = absorption_db_per_km(frequency_khz * 1000, Water(temperature_c, 35, 20, 8))
        assert ours == pytest.approx(ainslie_mccolm_db_per_km(frequency_khz, temperature_c, 35, 0.02, 8), rel=0.15)

    def test_at_10_khz_the_three_parts_by_hand(self) -> None:
        # 10 degrees C, 35 ppt, at the surface, pH 8: c = 1412 + 32.1 + 41.65 = 1485.75 m/s.
        # Boric acid: 8.86 / 1485.75 * 10^1.24 = 0.10363; f1 = 2.8 * 10^(4 - 1245 / 283) = 1.1170 kHz;
        # 0.10363 * 1.1170 * 100 / (1.2477 + 100) = 0.11433.
        # Sulphate: 21.44 * 35 / 1485.75 * 1.25 = 0.63133; f2 = 8.17 * 10^(8 - 1990 / 283) = 75.94 kHz;
        # 0.63133 * 75.94 * 100 / (5766.9 + 100) = 0.8172.
        # Water: 4.937e-4 - 2.59e-4 + 9.11e-5 - 1.5e-5 = 3.108e-4; times 100: 0.03108.
        assert absorption_db_per_km(10e3, Water(10, 35, 0, 8)) == pytest.approx(0.1143 + 0.8172 + 0.0311, abs=0.001)

    def test_warm_water_has_a_formula_of_its_own_that_joins(self) -> None:
        cold, warm = (absorption_db_per_km(500e3, Water(t_c, 35, 0, 8)) for t_c in (20.0, 20.001))
        assert warm == pytest.approx(cold, rel=0.002)


def test_sound_is_fainter_by_spreading_and_absorption() -> None:
    assert transmission_loss_db(1000, 15, 0) == pytest.approx(45)
    assert transmission_loss_db(2000, 20, 5) == pytest.approx(66.02 + 10, abs=0.01)
    assert transmission_loss_db(0, 15, 5) == 0


def test_a_bit_has_the_more_energy_the_longer_it_takes() -> None:
    assert bit_energy_db(120, 60, 100) == pytest.approx(40)
    assert bit_energy_db(120, 60, 1000) == pytest.approx(30)


class TestBitsWrong:
    def test_noncoherent_fsk(self) -> None:
        assert noncoherent_fsk_error_rate(0) == 0.5
        assert noncoherent_fsk_error_rate(10) == pytest.approx(0.5 * math.exp(-5))
        # At a bit error rate of 1e-5 the books have 13.4 dB.
        assert noncoherent_fsk_error_rate(10**1.34) == pytest.approx(1e-5, rel=0.2)

    def test_coherent_bpsk(self) -> None:
        assert coherent_bpsk_error_rate(0) == 0.5
        # 9.6 dB for 1e-5.
        assert coherent_bpsk_error_rate(10**0.96) == pytest.approx(1e-5, rel=0.05)

    def test_fading_is_rayleigh_s_with_no_steady_path_and_none_with_nothing_else(self) -> None:
        assert noncoherent_fsk_error_rate(98, rician_k=0) == pytest.approx(0.01)
        assert noncoherent_fsk_error_rate(10, rician_k=1e9) == pytest.approx(0.5 * math.exp(-5), rel=1e-6)
        # K 3 and Eb/N0 10: 4 / 18 * exp(-30 / 18).
        assert noncoherent_fsk_error_rate(10, rician_k=3) == pytest.approx(4 / 18 * math.exp(-5 / 3))

    @given(st.floats(0, 1e6), st.floats(0, 1e3))
    def test_fading_is_never_worse_than_guessing_and_never_better_than_no_fading(self, energy: float, k: float) -> None:
        fades = noncoherent_fsk_error_rate(energy, k)
        assert noncoherent_fsk_error_rate(energy) - 1e-12 <= fades <= 0.5


def test_a_frame_is_lost_with_one_bit_of_it() -> None:
    assert frame_error_rate(0, 256) == 0
    assert frame_error_rate(1, 256) == 1
    assert frame_error_rate(0.5, 2) == pytest.approx(0.75)
    assert frame_error_rate(1e-12, 100) == pytest.approx(1e-10)
