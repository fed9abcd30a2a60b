//! What the entries of a list of landmarks are called, by the name of its numbering.

/// A numbering known by name. What several have in common has the same name in each.
pub(super) struct Numbering {
    aliases: &'static [&'static str],
    /// The scheme that its names are of.
    pub scheme: &'static str,
    /// Put before the numbers, so that they mean nothing else's.
    prefix: &'static str,
    /// The numbers of its landmarks are those below, without the ones left out.
    end: usize,
    left_out: fn(usize) -> bool,
}

static KNOWN: [Numbering; 4] = [
    Numbering {
        aliases: &["multipie68", "ibug68", "300w", "dlib68"],
        scheme: "multipie68",
        prefix: "",
        end: 68,
        left_out: |_| false,
    },
    // Without the jaw.
    Numbering {
        aliases: &["multipie51", "ibug51"],
        scheme: "multipie68",
        prefix: "",
        end: 68,
        left_out: |number| number < 17,
    },
    // Without the inner corners of the lips too.
    Numbering {
        aliases: &["multipie49", "ibug49"],
        scheme: "multipie68",
        prefix: "",
        end: 68,
        left_out: |number| number < 17 || number == 60 || number == 64,
    },
    // What its points mean is not published in words.
    Numbering {
        aliases: &["caricshop38", "3dcaricshop38", "3dcaricshop"],
        scheme: "caricshop38",
        prefix: "caricshop38/",
        end: 38,
        left_out: |_| false,
    },
];

impl Numbering {
    /// The numbering that goes by this name, in any case.
    pub fn named(name: &str) -> Option<&'static Self> {
        KNOWN.iter().find(|known| known.aliases.iter().any(|alias| alias.eq_ignore_ascii_case(name)))
    }

    /// Landmarks that a list has.
    pub fn count(&self) -> usize {
        self.names().count()
    }

    /// What the landmarks of a list are called.
    fn names(&self) -> impl Iterator<Item = String> {
        (0..self.end)
            .filter(|&number| !(self.left_out)(number))
            .map(|number| format!("{}{number}", self.prefix))
    }

    /// The scheme's names of landmarks that are a list in this numbering, or called by these names themselves.
    pub fn apply(&self, names: Vec<String>, listed: bool) -> Result<Vec<String>, String> {
        let own: Vec<_> = self.names().collect();
        if own.len() == names.len() && counts_up(&names) {
            return Ok(own);
        }
        if listed {
            let said = self.aliases[0];
            return Err(format!(
                "are {}, but {said} has {}: state another scheme, or none",
                names.len(),
                own.len()
            ));
        }
        match names.iter().find(|name| !own.contains(name)) {
            Some(stranger) => Err(format!(
                "include `{}`, but those of {} are named {} to {}",
                crate::formats::text::shown(stranger.as_bytes()),
                self.aliases[0],
                own[0],
                own[own.len() - 1]
            )),
            None => Ok(names),
        }
    }
}

/// Whether names are "0", "1", ...
pub(super) fn counts_up(names: &[String]) -> bool {
    names.iter().enumerate().all(|(index, name)| *name == index.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(count: usize) -> Vec<String> {
        (0..count).map(|index| index.to_string()).collect()
    }

    #[test]
    fn subsets_have_the_names_of_the_whole() {
        let names = |name: &str| {
            let numbering = Numbering::named(name).unwrap();
            numbering.apply(list(numbering.count()), true).unwrap()
        };
        assert_eq!(names("iBUG68"), list(68));
        // The tip of the nose, the outer corners of the lips, and the last of the inner lips.
        assert_eq!([13, 31, 37, 50].map(|at| names("ibug51")[at].clone()), ["30", "48", "54", "67"]);
        assert_eq!([13, 31, 37, 48].map(|at| names("ibug49")[at].clone()), ["30", "48", "54", "67"]);
        let inner: Vec<_> = names("multipie49")[43..].to_vec();
        assert_eq!(inner, ["61", "62", "63", "65", "66", "67"]);
        assert_eq!(names("3DCaricShop")[37], "caricshop38/37");
    }

    #[test]
    fn other_counts_and_names_are_refused() {
        let multipie51 = Numbering::named("multipie51").unwrap();
        assert!(multipie51.apply(list(68), true).unwrap_err().contains("are 68, but multipie51 has 51"));
        assert!(multipie51.apply(vec!["30".to_owned()], false).is_ok());
        let jaw = multipie51.apply(vec!["16".to_owned()], false).unwrap_err();
        assert!(jaw.contains("include `16`") && jaw.contains("17 to 67"), "{jaw}");
        assert!(Numbering::named("wflw98").is_none());
    }
}
