use super::Adapter;

/// Why nothing is drawn.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RenderError {
    /// No driver for graphics.
    #[error(
        "no graphics adapter was found: install a Vulkan driver (in software on Debian and Ubuntu: apt install \
         mesa-vulkan-drivers), or choose the adapter \"reference\""
    )]
    NoAdapter,
    /// None of that name.
    #[error("no graphics adapter is called \"{wanted}\"; there are: {}", listed(.found))]
    NoSuchAdapter {
        /// What was asked for.
        wanted: String,
        /// What is there.
        found: Vec<Adapter>,
    },
    /// The driver failed.
    #[error("the graphics adapter {adapter} failed: {finding}")]
    Device {
        /// Which.
        adapter: String,
        /// How.
        finding: String,
    },
    /// More than the adapter takes.
    #[error("{what} is {found}, and the graphics adapter takes {limit} at most: {remedy}")]
    TooLarge {
        /// What is too large.
        what: String,
        /// How large it is.
        found: u64,
        /// How large it may be.
        limit: u64,
        /// What to do.
        remedy: &'static str,
    },
    /// A mesh without a triangle.
    #[error("the mesh to draw has no triangles")]
    NoTriangles,
    /// A triangle of vertices that are not there.
    #[error("triangle {triangle} has corners {corners:?}, and the mesh has {vertices} vertices")]
    Corner {
        /// Which.
        triangle: usize,
        /// Its corners.
        corners: [u32; 3],
        /// Number of vertices N.
        vertices: usize,
    },
    /// A surface that is not of the mesh.
    #[error("{found} {what} for a mesh of {vertices} vertices")]
    Count {
        /// Of which.
        what: &'static str,
        /// How many.
        found: usize,
        /// Number of vertices N.
        vertices: usize,
    },
    /// A vertex nowhere.
    #[error("the position of vertex {vertex} is not finite")]
    NotFinite {
        /// Which.
        vertex: usize,
    },
    /// A target that nothing can be compared with.
    #[error("target {index}: {finding}")]
    Target {
        /// Which of the list.
        index: usize,
        /// What is wrong with it.
        finding: String,
    },
    /// A target that is not there.
    #[error("target {index} is asked for, and {targets} are prepared")]
    NoSuchTarget {
        /// Which.
        index: usize,
        /// How many there are.
        targets: usize,
    },
    /// Lights of other targets.
    #[error("{found} lights for {targets} targets")]
    Lights {
        /// How many lights.
        found: usize,
        /// How many targets.
        targets: usize,
    },
}

fn listed(adapters: &[Adapter]) -> String {
    adapters.iter().map(Adapter::to_string).collect::<Vec<_>>().join("; ")
}
