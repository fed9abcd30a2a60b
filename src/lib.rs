//! onemesh: one mesh for every face. Registers collections of 3D face scans onto the triangles of one sphere, after
//! "Mesh Density Adaptation for Template-based Shape Reconstruction" (Jung et al., SIGGRAPH 2023), and further.
//!
//! # Layers
//! A module imports modules of lower layers only; `tests/architecture.rs` reads this table and holds it.
//!
//! | layer | modules | what they know |
//! |---|---|---|
//! | L0 | mesh | triangles, normals and edge lengths with their pull-backs, landmarks, template spheres |
//! | L1 | numeric, camera | sparse Cholesky, rotations between point sets, the optimiser; `numeric/cholesky` alone names nalgebra_sparse; what cameras see |
//! | L2 | spatial, reparam, energy, density, formats, picture, demo | nearest points, self-intersections; u and p; the terms that are minimised; target edge lengths; files; pictures; sculpted heads and figures |
//! | L3 | evaluate, preflight, render | figures of a result on its scan and across a collection; what is wrong with scans and landmarks; pictures that are differentiated, by a rasterizer that alone names wgpu |
//! | L4 | pipeline | the stages, their parameters, what they leave behind |
//! | L5 | job | what is asked for, its state, its store, its worker: one data folder; knows no HTTP |
//! | L6 | http | routes, wire types, problems, the OpenAPI document; alone names axum and utoipa |
//! | L7 | cli | the commands, in the program alone, which alone names clap, anyhow and indicatif |
//!
//! # Words
//! | word | meaning |
//! |---|---|
//! | scan | an input surface: any connectivity, closed or open, noisy, with holes |
//! | template | the mesh whose triangles every result shares: a geodesic sphere |
//! | landmark | a named point known on scans and, after resampling, on the template (triangle and barycentric weights) |
//! | collection | scans registered together: they share one template and one set of template landmarks |
//! | fit, register | template to one scan without landmarks, and with them |
//! | unit space | a scan moved and scaled so that its vertices' mean is the origin and the farthest is at distance one |
//! | p, u | template vertex positions `[N, 3]`; their diffusion re-parameterization u = (I + lambda L) p |
//! | l, l_u', l_k' | mean edge length per vertex `[N]`; its uniform and its adaptive target |
//! | residual, report | distance of a result from its scan; the numbers behind it |
//!
//! # From the paper's equations to files
//! | equation | what | where |
//! |---|---|---|
//! | (1) | mean edge lengths l | `mesh/edge_length.rs` |
//! | (2), (5) | adaptation energy E_a | `energy/adaptation.rs` |
//! | (3), (4) | u of p, p of u | `reparam.rs`, `numeric/cholesky.rs` |
//! | (11) | uniform target l_u' | `density/mod.rs` |
//! | (12) to (14) | curvature K, its diffusion S, adaptive target l_k' | `density/curvature.rs` |
//! | section 4.3 | the schedule of w_u and w_k | `pipeline/fit.rs` |
//! | (15), (16) | data term E_d, Chamfer distance D_c, in both directions | `energy/chamfer.rs` |
//! | (17) | normal loss D_n | `energy/normal.rs` |
//! | (18) | a fit without landmarks | `pipeline/fit.rs` |
//! | (19) to (21) | alignment and mean of sphere landmarks | `numeric/kabsch.rs`, `pipeline/resample.rs` |
//! | (22) | landmark loss, registration | `energy/landmark.rs`, `pipeline/register.rs` |
//! | ours | foldover, the groupwise stage | `energy/foldover.rs`, `pipeline/groupwise/` |

pub mod camera;
pub mod demo;
pub mod density;
pub mod energy;
pub mod evaluate;
pub mod formats;
pub mod http;
pub mod job;
pub mod mesh;
pub mod numeric;
pub mod picture;
pub mod pipeline;
pub mod preflight;
pub mod render;
pub mod reparam;
pub mod spatial;
