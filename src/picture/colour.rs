use std::ops::{Add, Mul};

/// A colour as linear light, red, green and blue in [0, 1].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Colour(pub [f32; 3]);

impl Colour {
    /// White paper.
    pub const WHITE: Self = Self([1.0; 3]);
    /// Black ink.
    pub const BLACK: Self = Self([0.0; 3]);

    /// The colour written as `0xRRGGBB` in sRGB.
    pub fn srgb(hex: u32) -> Self {
        Self([16, 8, 0].map(|shift| decoded(((hex >> shift) & 0xff) as f32 / 255.0)))
    }

    /// A heat map's colour for `value` in [0, 1]: pale blue, green, yellow, red; beyond 1 dark red, NaN grey.
    pub fn heat(value: f64) -> Self {
        const STOPS: [u32; 6] = [0x3b6fb6, 0x5fb7c9, 0x8fcf7a, 0xf6e05a, 0xef8a3c, 0xc3222a];
        if value.is_nan() {
            return Self::srgb(0x999999);
        }
        if value > 1.0 {
            return Self::srgb(0x7a0f1c);
        }
        let at = value.max(0.0) * (STOPS.len() - 1) as f64;
        let stop = (at as usize).min(STOPS.len() - 2);
        Self::srgb(STOPS[stop]).mix(Self::srgb(STOPS[stop + 1]), (at - stop as f64) as f32)
    }

    /// `self` at `weight` 0, `other` at 1.
    pub fn mix(self, other: Self, weight: f32) -> Self {
        self * (1.0 - weight) + other * weight
    }

    /// The eight-bit sRGB bytes.
    pub fn bytes(self) -> [u8; 3] {
        self.0.map(|light| (encoded(light.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8)
    }
}

impl Add for Colour {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self([0, 1, 2].map(|i| self.0[i] + other.0[i]))
    }
}

impl Mul<f32> for Colour {
    type Output = Self;
    fn mul(self, factor: f32) -> Self {
        Self(self.0.map(|light| light * factor))
    }
}

fn decoded(value: f32) -> f32 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

fn encoded(light: f32) -> f32 {
    if light <= 0.003_130_8 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn survives_the_way_to_bytes() {
        for hex in [0x000000, 0x123456, 0xabcdef, 0xffffff] {
            let [_, r, g, b] = u32::to_be_bytes(hex);
            assert_eq!(Colour::srgb(hex).bytes(), [r, g, b]);
        }
    }

    #[test]
    fn heats_from_blue_to_red() {
        let [cold, hot] = [0.0, 1.0].map(|v| Colour::heat(v).bytes());
        assert!(cold[2] > cold[0] && hot[0] > hot[2]);
    }
}
