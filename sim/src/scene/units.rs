//! Quantities of scene files: what a number means and which units a text such as `"2 cm"` may carry.

use super::suggest;

/// What a number in a scene file measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// A bare number.
    Number,
    Length,
    Time,
    /// In degrees.
    Angle,
    Speed,
    /// Events or decay a second.
    Rate,
    Volume,
    /// Volume a second.
    Flow,
    /// Attenuation and the like.
    PerLength,
    Density,
    /// Manning's roughness.
    Roughness,
    /// Stops of exposure.
    Exposure,
    /// Only to recognise a wrong unit.
    Mass,
    /// Only to recognise a wrong unit.
    Area,
}

use Quantity::{
    Angle, Area, Density, Exposure, Flow, Length, Mass, Number, PerLength, Rate, Roughness, Speed, Time,
    Volume,
};

/// Every unit: its name, what it measures, and its size in the unit that bare numbers have.
const UNITS: &[(&str, Quantity, f64)] = &[
    ("m", Length, 1.0),
    ("mm", Length, 1e-3),
    ("cm", Length, 1e-2),
    ("km", Length, 1e3),
    ("in", Length, 0.0254),
    ("ft", Length, 0.3048),
    ("nmi", Length, 1852.0),
    ("s", Time, 1.0),
    ("ms", Time, 1e-3),
    ("min", Time, 60.0),
    ("h", Time, 3600.0),
    ("deg", Angle, 1.0),
    ("°", Angle, 1.0),
    ("rad", Angle, 180.0 / std::f64::consts::PI),
    ("arcmin", Angle, 1.0 / 60.0),
    ("m/s", Speed, 1.0),
    ("mm/s", Speed, 1e-3),
    ("cm/s", Speed, 1e-2),
    ("km/h", Speed, 1.0 / 3.6),
    ("kn", Speed, 1852.0 / 3600.0),
    ("1/s", Rate, 1.0),
    ("Hz", Rate, 1.0),
    ("1/min", Rate, 1.0 / 60.0),
    ("1/h", Rate, 1.0 / 3600.0),
    ("m3", Volume, 1.0),
    ("m³", Volume, 1.0),
    ("l", Volume, 1e-3),
    ("L", Volume, 1e-3),
    ("ml", Volume, 1e-6),
    ("mL", Volume, 1e-6),
    ("cm3", Volume, 1e-6),
    ("cm³", Volume, 1e-6),
    ("mm3", Volume, 1e-9),
    ("mm³", Volume, 1e-9),
    ("m3/s", Flow, 1.0),
    ("m³/s", Flow, 1.0),
    ("l/s", Flow, 1e-3),
    ("1/m", PerLength, 1.0),
    ("1/cm", PerLength, 1e2),
    ("1/mm", PerLength, 1e3),
    ("1/km", PerLength, 1e-3),
    ("kg/m3", Density, 1.0),
    ("kg/m³", Density, 1.0),
    ("g/cm3", Density, 1e3),
    ("g/cm³", Density, 1e3),
    ("s/m^(1/3)", Roughness, 1.0),
    ("EV", Exposure, 1.0),
    ("stops", Exposure, 1.0),
    ("kg", Mass, 1.0),
    ("g", Mass, 1e-3),
    ("t", Mass, 1e3),
    ("m2", Area, 1.0),
    ("m²", Area, 1.0),
];

impl Quantity {
    /// Name with its article, for messages.
    pub(crate) fn with_article(self) -> &'static str {
        match self {
            Number => "a number",
            Length => "a length",
            Time => "a time",
            Angle => "an angle",
            Speed => "a speed",
            Rate => "a rate",
            Volume => "a volume",
            Flow => "a flow",
            PerLength => "a coefficient per length",
            Density => "a density",
            Roughness => "a roughness",
            Exposure => "an exposure",
            Mass => "a mass",
            Area => "an area",
        }
    }

    /// The unit of bare numbers, as in the documentation; empty for numbers without one.
    pub(crate) fn base_unit(self) -> &'static str {
        match self {
            Number => "",
            Angle => "deg",
            Exposure => "stops",
            _ => self.units().next().unwrap_or(""),
        }
    }

    /// Names of its units.
    fn units(self) -> impl Iterator<Item = &'static str> {
        UNITS.iter().filter(move |u| u.1 == self).map(|u| u.0)
    }

    /// What to write instead of something that is not such a quantity.
    pub(crate) fn remedy(self) -> String {
        if self == Number {
            return "write a number".into();
        }
        let units: Vec<_> = self.units().collect();
        format!(
            "write {} as a number of {} or as a text with a unit ({}), such as \"1.5 {}\"",
            self.with_article(),
            self.base_unit(),
            units.join(", "),
            units.get(1).unwrap_or(&units[0]),
        )
    }

    /// Reads a text such as `"2 cm"`; the result is in the unit of bare numbers.
    ///
    /// # Errors
    /// What is wrong and what would be right.
    pub(crate) fn parse(self, text: &str) -> Result<f64, (String, String)> {
        let text = text.trim();
        let (number, unit) = split(text);
        let Ok(value) = number.parse::<f64>() else {
            return Err((
                format!("\"{text}\" is not {}", self.with_article()),
                self.remedy(),
            ));
        };
        if unit.is_empty() {
            let remedy = match self {
                Number => format!("write {number} without quotes"),
                _ => format!(
                    "write {number} without quotes, or \"{number} {}\"",
                    self.base_unit()
                ),
            };
            return Err((format!("the text \"{text}\" has no unit"), remedy));
        }
        if self == Number {
            return Err((
                format!("\"{text}\" has a unit, but this is a bare number"),
                "write it without a unit".into(),
            ));
        }
        match UNITS.iter().find(|u| u.0 == unit) {
            Some(&(_, quantity, factor)) if quantity == self => Ok(scaled(value, factor)),
            Some(&(_, other, _)) => Err((
                format!("`{unit}` is a unit of {}, not of {}", bare(other), bare(self)),
                self.remedy(),
            )),
            None => {
                let remedy = match suggest::nearest(unit, self.units()) {
                    Some(near) => format!("did you mean `{near}`? {}", self.remedy()),
                    None => self.remedy(),
                };
                Err((format!("`{unit}` is not a known unit"), remedy))
            }
        }
    }
}

/// `value · factor`, rounded once where the factor is one over a whole number: 2 cm is the same number as 0.02 m.
fn scaled(value: f64, factor: f64) -> f64 {
    let inverse = (1.0 / factor).round();
    if factor < 1.0 && inverse * factor == 1.0 {
        value / inverse
    } else {
        value * factor
    }
}

fn bare(quantity: Quantity) -> &'static str {
    let name = quantity.with_article();
    name.split_once(' ').map_or(name, |(_, rest)| rest)
}

/// Splits a number from the unit behind it.
fn split(text: &str) -> (&str, &str) {
    // A unit such as `1/s` may begin with a digit, so blank space decides where there is some.
    if let Some((number, unit)) = text.split_once(char::is_whitespace) {
        return (number, unit.trim_start());
    }
    let mut end = 0;
    for (at, c) in text.char_indices() {
        let exponent = matches!(c, 'e' | 'E')
            && text[at + 1..].starts_with(|d: char| d.is_ascii_digit() || d == '-' || d == '+')
            && at > 0;
        let sign = matches!(c, '+' | '-') && (at == 0 || text[..at].ends_with(['e', 'E']));
        if !(c.is_ascii_digit() || c == '.' || exponent || sign) {
            break;
        }
        end = at + c.len_utf8();
    }
    text.split_at(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_convert_and_round_once() {
        assert_eq!(Length.parse("2 cm"), Ok(0.02));
        assert_eq!(Length.parse("2cm"), Ok(0.02));
        assert_eq!(Length.parse(" -1.5e-1 km "), Ok(-150.0));
        assert_eq!(Length.parse("1e3mm"), Ok(1.0));
        assert_eq!(Time.parse("1.5 min"), Ok(90.0));
        assert_eq!(Rate.parse("30 1/min"), Ok(0.5));
        assert_eq!(Volume.parse("3 ml"), Ok(3e-6));
        assert_eq!(Angle.parse("30 deg"), Ok(30.0));
        assert!((Angle.parse("1 rad").unwrap() - 1.0_f64.to_degrees()).abs() < 1e-13);
        assert!((Speed.parse("36 km/h").unwrap() - 10.0).abs() < 1e-12);
        assert_eq!(Density.parse("0.6 g/cm3"), Ok(600.0));
    }

    #[test]
    fn wrong_units_say_what_they_are() {
        let message = |q: Quantity, text| q.parse(text).unwrap_err();
        assert_eq!(message(Length, "2 kg").0, "`kg` is a unit of mass, not of length");
        assert_eq!(message(Length, "2 furlongs").0, "`furlongs` is not a known unit");
        assert!(message(Time, "2 mins").1.starts_with("did you mean `min`?"));
        assert_eq!(message(Length, "2").0, "the text \"2\" has no unit");
        assert_eq!(
            message(Number, "2 m").0,
            "\"2 m\" has a unit, but this is a bare number"
        );
        assert_eq!(message(Length, "wide").0, "\"wide\" is not a length");
        assert_eq!(message(Length, "").0, "\"\" is not a length");
    }

    #[test]
    fn every_unit_is_named_once_and_measures_something() {
        for (k, (name, quantity, factor)) in UNITS.iter().enumerate() {
            assert!(*factor > 0.0 && factor.is_finite());
            assert!(UNITS[..k].iter().all(|u| u.0 != *name), "{name}");
            if !matches!(quantity, Mass | Area) {
                assert_eq!(quantity.parse(&format!("1 {name}")), Ok(scaled(1.0, *factor)));
            }
        }
    }
}
