use serde::{Deserialize, Serialize};

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Worth knowing.
    Info,
    /// May spoil a part of the result.
    Warning,
    /// Will spoil the result.
    Error,
}

impl Severity {
    /// Its name, as it is serialised.
    pub fn name(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

macro_rules! codes {
    ($($(#[$doc:meta])* $code:ident = $name:literal, $severity:ident;)*) => {
        /// What is found, under a name that stays.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[non_exhaustive]
        pub enum Code {
            $($(#[$doc])* #[serde(rename = $name)] $code,)*
        }

        impl Code {
            /// Every code.
            pub const ALL: &'static [Self] = &[$(Self::$code,)*];

            /// Its name, as it is serialised.
            pub fn name(self) -> &'static str {
                match self { $(Self::$code => $name,)* }
            }

            /// How much it matters.
            pub fn severity(self) -> Severity {
                match self { $(Self::$code => Severity::$severity,)* }
            }
        }
    };
}

codes! {
    /// A length of one unit could be a metre, a centimetre or a millimetre.
    UnitUnclear = "unit_unclear", Warning;
    /// Which way is up and where the face looks is a guess.
    AxesGuessed = "axes_guessed", Info;
    /// The surface is in several parts.
    SeveralComponents = "several_components", Warning;
    /// The surface has rims.
    OpenBoundary = "open_boundary", Info;
    /// Three or more triangles share an edge.
    NonManifoldEdges = "non_manifold_edges", Warning;
    /// Surfaces touch in a vertex only.
    NonManifoldVertices = "non_manifold_vertices", Warning;
    /// Triangles have no area.
    DegenerateTriangles = "degenerate_triangles", Warning;
    /// Triangles are there more than once.
    DuplicateTriangles = "duplicate_triangles", Warning;
    /// Neighbouring triangles have opposed normals.
    OrientationInconsistent = "orientation_inconsistent", Warning;
    /// The normals point inwards.
    InsideOut = "inside_out", Error;
    /// No triangle names some vertices.
    UnreferencedVertices = "unreferenced_vertices", Info;
    /// No landmark is there, or too few to turn the scan.
    TooFewLandmarks = "too_few_landmarks", Error;
    /// Some landmarks are missing.
    LandmarksMissing = "landmarks_missing", Warning;
    /// The landmarks' scheme is not known, so that what they mean cannot be checked.
    SchemeUnknown = "scheme_unknown", Info;
    /// Some landmarks do not lie on the surface.
    LandmarksOffSurface = "landmarks_off_surface", Warning;
    /// Most landmarks do not lie on the surface.
    LandmarksElsewhere = "landmarks_elsewhere", Error;
    /// The landmarks are those of a mirrored face.
    LandmarksMirrored = "landmarks_mirrored", Error;
    /// The names of left and right landmarks are exchanged.
    LeftRightSwapped = "left_right_swapped", Error;
    /// Two landmarks are exchanged.
    LandmarksSwapped = "landmarks_swapped", Warning;
    /// A landmark is not where it should be.
    LandmarkMisplaced = "landmark_misplaced", Warning;
    /// The landmarks are no face in the order of their scheme or of the other scans.
    LandmarksDisordered = "landmarks_disordered", Error;
}

/// One thing that is worth knowing of a scan before it is registered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// What it is.
    pub code: Code,
    /// How much it matters.
    pub severity: Severity,
    /// What was found, in a sentence.
    pub found: String,
    /// What to do about it.
    pub advice: String,
    /// The landmarks that it is about.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub landmarks: Vec<String>,
}

impl Finding {
    pub(super) fn new(code: Code, found: impl Into<String>, advice: impl Into<String>) -> Self {
        Self {
            code,
            severity: code.severity(),
            found: found.into(),
            advice: advice.into(),
            landmarks: Vec::new(),
        }
    }

    pub(super) fn about<'a>(mut self, landmarks: impl IntoIterator<Item = &'a str>) -> Self {
        self.landmarks = landmarks.into_iter().map(str::to_owned).collect();
        self
    }
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}: {}; {}", self.severity.name(), self.code.name(), self.found, self.advice)
    }
}

/// Some names in backticks, and how many more there are.
pub(super) fn some_of(names: &[&str]) -> String {
    const MOST: usize = 6;
    let some: Vec<_> = names.iter().take(MOST).map(|name| format!("`{name}`")).collect();
    let more = names.len().saturating_sub(MOST);
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    some.join(", ") + &rest
}
