use std::ops::Add;

use glam::{DVec2, DVec3};

use super::raster::{Raster, barycentric, doubled_area, middle};
use super::view::Projection;
use super::{Colour, Dot, Image, Shading, Style, View, Wireframe};
use crate::mesh::TriangleMesh;

/// Samples on each side of a pixel.
const SPLITS: usize = 2;

/// Draws `mesh` as seen from `view`.
///
/// # Panics
/// If the style's vertex colours are not one a vertex.
pub fn render(mesh: &TriangleMesh, view: &View, style: &Style) -> Image {
    if let Some(colours) = &style.vertex_colours {
        assert_eq!(colours.len(), mesh.positions().len(), "one colour for every vertex");
    }
    let projection = view.projection(mesh, SPLITS);
    let points: Vec<_> = mesh.positions().iter().map(|&p| projection.point(p)).collect();
    let [width, height] = view.size.map(|side| side * SPLITS);
    let raster = Raster::draw(width, height, &points, mesh.triangles());
    let scene = Scene { mesh, style, points, normals: seen_normals(mesh, &projection) };
    let mut samples = scene.shaded(&raster);
    for dot in &style.dots {
        draw_dot(&mut samples, &raster, &projection, dot);
    }
    averaged(&samples, view.size)
}

/// A mesh as projected for one picture.
struct Scene<'a> {
    mesh: &'a TriangleMesh,
    style: &'a Style,
    /// Column, row and nearness of each vertex `[N, 3]`.
    points: Vec<DVec3>,
    /// Normals of the vertices as the viewer sees them `[N, 3]`.
    normals: Vec<DVec3>,
}

impl Scene<'_> {
    fn shaded(&self, raster: &Raster) -> Vec<Colour> {
        let mut samples = Vec::with_capacity(raster.width * raster.height);
        for y in 0..raster.height {
            for x in 0..raster.width {
                let seen = raster.seen(x, y).and_then(|triangle| self.colour(triangle, middle(x, y)));
                samples.push(seen.unwrap_or(self.style.paper));
            }
        }
        samples
    }

    fn colour(&self, triangle: u32, at: DVec2) -> Option<Colour> {
        let ids = self.mesh.triangles()[triangle as usize].map(|i| i as usize);
        let corners = ids.map(|i| self.points[i]);
        let weights = barycentric(at, corners)?;
        let outside = doubled_area(corners) < 0.0;
        let paint = match &self.style.vertex_colours {
            _ if !outside => self.style.inside,
            Some(colours) => {
                (0..3).map(|i| colours[ids[i]] * weights[i] as f32).fold(Colour::BLACK, Colour::add)
            }
            None => self.style.surface,
        };
        let lit = paint * light(self.normal(ids, weights, outside));
        Some(match &self.style.wireframe {
            Some(lines) => lit.mix(lines.colour, coverage(corners, weights, lines)),
            None => lit,
        })
    }

    /// The normal towards the viewer.
    fn normal(&self, ids: [usize; 3], weights: [f64; 3], outside: bool) -> DVec3 {
        let normal = match self.style.shading {
            Shading::Smooth => (0..3).map(|i| self.normals[ids[i]] * weights[i]).sum::<DVec3>(),
            Shading::Flat => {
                let [a, b, c] = ids.map(|i| self.points[i] * DVec3::new(1.0, -1.0, 1.0));
                (b - a).cross(c - a)
            }
        };
        normal.normalize_or_zero() * if outside { 1.0 } else { -1.0 }
    }
}

/// Vertex normals, weighted by area, as the viewer sees them.
fn seen_normals(mesh: &TriangleMesh, projection: &Projection) -> Vec<DVec3> {
    let positions = mesh.positions();
    let mut normals = vec![DVec3::ZERO; positions.len()];
    for corners in mesh.triangles().iter().map(|t| t.map(|i| i as usize)) {
        let [a, b, c] = corners.map(|i| positions[i]);
        let normal = (b - a).cross(c - a);
        corners.iter().for_each(|&i| normals[i] += normal);
    }
    normals.iter().map(|&n| projection.direction(n).normalize_or_zero()).collect()
}

/// Light from a key lamp above the viewer's left shoulder, a fill lamp on their right, and the sky.
fn light(normal: DVec3) -> f32 {
    let lamp = |x, y, z| normal.dot(DVec3::new(x, y, z).normalize()).max(0.0);
    let key = lamp(-0.75, 0.75, 1.0);
    let fill = lamp(0.9, 0.1, 0.5);
    let sky = 0.5 + 0.5 * normal.y;
    (0.04 + 0.86 * key + 0.2 * fill + 0.1 * sky) as f32
}

/// How much of a sample the lines along a triangle's edges cover.
fn coverage(corners: [DVec3; 3], weights: [f64; 3], lines: &Wireframe) -> f32 {
    let area = doubled_area(corners).abs();
    let sides = [0, 1, 2].map(|i| (corners[(i + 2) % 3] - corners[(i + 1) % 3]).truncate().length());
    let distance = (0..3).map(|i| weights[i] * area / sides[i]).fold(f64::INFINITY, f64::min);
    let half = lines.width * SPLITS as f64 / 2.0;
    // Where triangles are hardly larger than the lines, fainter ones leave the shading visible.
    let inner_radius = area / sides.iter().sum::<f64>();
    let strength = (inner_radius / (2.0 * half)).min(1.0);
    ((half + 0.5 - distance).clamp(0.0, 1.0) * strength) as f32
}

/// Draws a dot with a thin white rim unless the surface hides it.
fn draw_dot(samples: &mut [Colour], raster: &Raster, projection: &Projection, dot: &Dot) {
    let centre = projection.point(dot.position);
    let radius = dot.radius * SPLITS as f64;
    let rim = radius + SPLITS as f64;
    // A landmark lies on the surface, or slightly under it.
    if raster.hides(centre, 3.0 * radius) {
        return;
    }
    let range = |middle: f64, size: usize| {
        let bound = |value: f64| value.clamp(0.0, size as f64) as usize;
        bound(middle - rim)..bound(middle + rim + 1.0)
    };
    for y in range(centre.y, raster.height) {
        for x in range(centre.x, raster.width) {
            let distance = middle(x, y).distance(centre.truncate());
            if distance < rim {
                let colour = if distance < radius { dot.colour } else { Colour::WHITE };
                samples[y * raster.width + x] = colour;
            }
        }
    }
}

/// The mean of each pixel's samples.
fn averaged(samples: &[Colour], [width, height]: [usize; 2]) -> Image {
    let mut image = Image::filled(width, height, Colour::WHITE);
    for y in 0..height {
        for x in 0..width {
            let mut sum = Colour::BLACK;
            for sample in 0..SPLITS * SPLITS {
                let [column, row] = [x * SPLITS + sample % SPLITS, y * SPLITS + sample / SPLITS];
                sum = sum + samples[row * width * SPLITS + column];
            }
            image.set(x, y, (sum * (1.0 / (SPLITS * SPLITS) as f32)).bytes());
        }
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::Frame;

    /// A sphere of latitude rings; every other way round if `inside_out`.
    fn sphere(rings: u32, inside_out: bool) -> TriangleMesh {
        let around = 2 * rings;
        let mut positions = Vec::new();
        for ring in 0..=rings {
            let (height, out) = (std::f64::consts::PI * f64::from(ring) / f64::from(rings)).sin_cos();
            for step in 0..around {
                let (x, z) = (std::f64::consts::TAU * f64::from(step) / f64::from(around)).sin_cos();
                positions.push(DVec3::new(height * x, out, height * z));
            }
        }
        let mut triangles = Vec::new();
        for ring in 0..rings {
            for step in 0..around {
                let next = (step + 1) % around;
                let [a, b] = [step, next].map(|s| ring * around + s);
                let [c, d] = [step, next].map(|s| (ring + 1) * around + s);
                triangles.extend([[a, c, d], [a, d, b]]);
            }
        }
        if inside_out {
            triangles.iter_mut().for_each(|t| t.swap(0, 1));
        }
        TriangleMesh::new(positions, triangles).unwrap()
    }

    fn small() -> View {
        View::front().sized(60, 60)
    }

    #[test]
    fn lights_a_sphere_from_the_upper_left() {
        let image = render(&sphere(24, false), &small(), &Style::smooth());
        assert_eq!(image.pixel(1, 1), [255; 3], "paper in the corner");
        let [lit, shade] = [image.pixel(20, 20)[0], image.pixel(42, 46)[0]];
        assert!(lit > 180 && shade < lit - 40, "lit {lit}, shade {shade}");
    }

    #[test]
    fn warns_of_a_sphere_turned_inside_out() {
        let [r, g, b] = render(&sphere(24, true), &small(), &Style::smooth()).pixel(30, 30);
        assert!(r > 150 && g < 60 && b < 60);
    }

    #[test]
    fn draws_dots_only_in_front() {
        let dot = |z| Dot { position: DVec3::Z * z, colour: Colour::BLACK, radius: 3.0 };
        let drawn = |z| {
            let style = Style { dots: vec![dot(z)], ..Style::smooth() };
            render(&sphere(24, false), &small(), &style).pixel(30, 30)
        };
        assert_eq!(drawn(1.0), [0; 3]);
        assert_ne!(drawn(-1.0), [0; 3]);
    }

    #[test]
    fn draws_edges_and_colours() {
        let mesh = sphere(6, false);
        let view = small().framed(Frame::around(&mesh));
        let heat = vec![0.0; mesh.positions().len()];
        let plain = render(&mesh, &view, &Style::smooth().heated(&heat, 1.0));
        let [r, _, b] = plain.pixel(30, 30);
        assert!(b > r, "cold is blue");
        let dark = |image: &Image| (0..60).filter(|&x| image.pixel(x, 33)[0] < 90).count();
        let edges = render(&mesh, &view, &Style::wireframe());
        assert!(dark(&edges) > 3);
    }
}
