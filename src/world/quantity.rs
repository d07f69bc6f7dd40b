//! Quantities of light, and the units of lamps and light meters.

/// Lumens of a watt: those of light of 555 nm, a ratio that programs apply to all light. A watt is thus a measure of
/// visible light, and a colour's lumens are 683 times its luminance.
pub(crate) const LUMENS_PER_WATT: f32 = 683.0;

/// A quantity of light, in radiometric units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Quantity {
    /// The power of a light in W, which is this many times its intensity straight ahead in W/sr, if that is known.
    Power(Option<f32>),
    /// Irradiance in W m⁻².
    Irradiance,
    /// Radiance in W m⁻² sr⁻¹.
    Radiance,
}

#[cfg_attr(not(feature = "formats"), allow(dead_code, reason = "only readers of files know units"))]
impl Quantity {
    /// The power of a light of the same intensity in all directions, as that of a spotlight without its cone.
    pub(crate) const ALL_AROUND: Quantity = Quantity::Power(Some(4.0 * std::f32::consts::PI));
    /// The power of a flat light of the same radiance in all directions.
    pub(crate) const FLAT: Quantity = Quantity::Power(Some(std::f32::consts::PI));
    /// The names of all photometric units.
    pub(crate) const UNITS: [&str; 4] = ["Lumens", "Candela", "Lux", "Nits"];

    /// The photometric units in which the quantity can be given, each with its value in the quantity's own unit.
    pub(crate) fn units(self) -> Vec<(&'static str, f32)> {
        let watt = 1.0 / LUMENS_PER_WATT;
        match self {
            Quantity::Power(Some(per_intensity)) => {
                vec![("Lumens", watt), ("Candela", per_intensity / LUMENS_PER_WATT)]
            }
            Quantity::Power(None) => vec![("Lumens", watt)],
            Quantity::Irradiance => vec![("Lux", watt)],
            Quantity::Radiance => vec![("Nits", watt)],
        }
    }
}
