use std::convert::Infallible;
use std::fmt;
use std::str::FromStr;

/// What can draw.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Adapter {
    /// As its driver calls it.
    pub name: String,
    /// What it is.
    pub kind: AdapterKind,
    /// The driver with its version; empty where it does not tell.
    pub driver: String,
}

impl fmt::Display for Adapter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}", self.name, self.kind)?;
        if !self.driver.is_empty() {
            write!(f, ", {}", self.driver)?;
        }
        f.write_str(")")
    }
}

/// What an adapter is, the preferred first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum AdapterKind {
    /// A graphics card.
    Discrete,
    /// Graphics on the processor's chip.
    Integrated,
    /// Graphics lent to a virtual machine, or of a kind that its driver does not tell.
    Virtual,
    /// A driver that draws on the processor, such as Mesa's lavapipe.
    Software,
    /// This program's own rasterizer on the processor.
    Reference,
}

impl fmt::Display for AdapterKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Software => "software",
            Self::Reference => "reference",
        })
    }
}

/// Which adapter to draw with.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// The first of discrete, integrated, virtual and software ones.
    #[default]
    Best,
    /// The first that is not in software, or else [`Self::Reference`], which is faster than drivers in software.
    Fastest,
    /// The first whose name or driver has these letters, in either case.
    Named(String),
    /// This program's own rasterizer on the processor.
    Reference,
}

impl FromStr for AdapterChoice {
    type Err = Infallible;

    /// `best`, `fastest`, `reference`, or part of a name.
    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(match text.trim() {
            "" | "best" => Self::Best,
            "fastest" => Self::Fastest,
            "reference" => Self::Reference,
            name => Self::Named(name.into()),
        })
    }
}

impl fmt::Display for AdapterChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Best => "best",
            Self::Fastest => "fastest",
            Self::Named(name) => name,
            Self::Reference => "reference",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_are_read_as_they_are_shown() {
        for text in ["best", "fastest", "reference", "GeForce RTX"] {
            assert_eq!(text.parse::<AdapterChoice>().unwrap().to_string(), text);
        }
        assert_eq!("".parse(), Ok(AdapterChoice::Best));
    }
}
